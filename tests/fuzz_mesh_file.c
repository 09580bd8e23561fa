// fuzz_mesh_file.c - libFuzzer's entrance to the readers of OBJ, MTL and glTF files (clang, -DVT_FUZZ=ON)
// SPDX-License-Identifier: BSD-3-Clause
//
// The first byte says which kind of file the others are. Start it on small files of each kind, each with that byte put
// in front. test_synthetic_mesh_damage.c runs the same check on seeded damage, so that it is done where there is no
// libFuzzer.
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/mesh_hostile.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static const char *const names[] = {"small.obj", "small.glb", "small.gltf", "small.mtl"};
  static char folder[64]; // one for the whole run
  if (size < 1) return 0;
  if (!*folder) {
    snprintf(folder, sizeof folder, "/tmp/voltree-fuzz-XXXXXX");
    VT_ASSERT(mkdtemp(folder));
  }
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  desc.log_level = VT_LOG_QUIET;
  desc.max_memory = 1ull << 30;
  vt_context *context = vt_create_context(&desc);
  char path[128], library[128];
  int kind = data[0] % 4;
  snprintf(path, sizeof path, "%s/%s", folder, names[kind == 3 ? 0 : kind]);
  snprintf(library, sizeof library, "%s/small.mtl", folder);
  FILE *file = fopen(library, "wb");
  const char *mtl = small_mtl(), *obj = small_obj();
  VT_ASSERT(file);
  if (kind == 3)
    fwrite(data + 1, 1, size - 1, file);
  else
    fwrite(mtl, 1, strlen(mtl), file);
  VT_ASSERT(!fclose(file));
  if (kind == 3)
    (void)read_sound_or_refused(context, path, (const uint8_t *)obj, strlen(obj));
  else
    (void)read_sound_or_refused(context, path, data + 1, size - 1);
  vt_destroy_context(context); // asserts that nothing is left
  return 0;
}
