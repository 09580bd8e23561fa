// mesh_hostile.h - what must hold for whatever bytes a mesh file has
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_MESH_HOSTILE_H
#define VT_TESTS_MESH_HOSTILE_H

#include "tests/mesh_bench.h"

// Reads the bytes as a file of this name in the folder. The result is a sound mesh (true), or an error with a sentence
// that names a file, and nothing is left behind.
static inline bool read_sound_or_refused(vt_context *context, const char *path, const uint8_t *data, size_t size) {
  vt_mesh mesh;
  (void)unlink(path); // a file that is cut to nothing and written again is waited for by some file systems
  FILE *file = fopen(path, "wb");
  VT_ASSERT(file && fwrite(data, 1, size, file) == size && !fclose(file));
  uint64_t before = vt_bytes_in_use(context);
  vt_status status = vt_read_mesh(context, path, &mesh);
  VT_ASSERT(status == VT_OK || status == VT_BAD_INPUT || status == VT_OUT_OF_MEMORY || status == VT_MISSING_PROGRAM);
  VT_ASSERT(status == VT_OK || vt_last_error(context)[0]);
  VT_ASSERT(status != VT_BAD_INPUT ||
            (strstr(vt_last_error(context), "small") && strstr(vt_last_error(context), "; ")));
  vt_clear_error(context);
  for (size_t t = 0; !status && t < mesh.triangle_count; t++) {
    VT_ASSERT(mesh.triangle_materials[t] < mesh.material_count);
    VT_ASSERT(mesh.materials[mesh.triangle_materials[t]].thin == (t >= mesh.solid_count));
    for (int i = 0; i < 3; i++) VT_ASSERT(mesh.triangles[t][i] < mesh.vertex_count);
  }
  for (size_t v = 0; !status && v < mesh.vertex_count; v++) {
    const float *p = mesh.vertices[v].position, *n = mesh.vertices[v].normal, *a = mesh.vertices[v].albedo;
    for (int k = 0; k < 3; k++) VT_ASSERT(isfinite(p[k]) && isfinite(n[k]) && a[k] >= 0 && a[k] <= 1);
    VT_ASSERT(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5f);
  }
  for (int m = 0; !status && m < mesh.material_count; m++) {
    const vt_material *x = &mesh.materials[m];
    for (int k = 0; k < 3; k++) VT_ASSERT(x->albedo[k] >= 0 && x->albedo[k] <= 1 && isfinite(x->translucency[k]));
    VT_ASSERT(x->specular >= 0 && x->specular <= 1 && x->roughness >= 0 && x->roughness <= 1);
    VT_ASSERT(x->cutoff >= 0 && x->cutoff <= 1 && memchr(x->name, 0, sizeof x->name));
  }
  VT_ASSERT(status || mesh.triangle_count);
  vt_free_mesh(context, &mesh);
  VT_ASSERT(vt_bytes_in_use(context) == before);
  return !status;
}

#endif
