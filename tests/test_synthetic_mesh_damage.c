// test_synthetic_mesh_damage.c - mesh files that are wrong, cut short, damaged or hostile
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/mesh_hostile.h"

static void put_small_files(bench *b) {
  put_file(b, "small.mtl", small_mtl(), strlen(small_mtl()));
  put_file(b, "small.obj", small_obj(), strlen(small_obj()));
}

static void assert_refused(bench *b, const char *name, const char *text, vt_status expected, const char *why) {
  vt_mesh mesh;
  put_file(b, name, text, strlen(text));
  vt_status status = vt_read_mesh(b->context, in_folder(b, name), &mesh);
  if (status != expected || !strstr(vt_last_error(b->context), why) || !strstr(vt_last_error(b->context), "; "))
    fail_msg("%s: status %d, '%s' does not say '%s'", text, status, vt_last_error(b->context), why);
  assert_null(mesh.vertices);
  vt_clear_error(b->context);
}

static void names_of_other_kinds_and_missing_files_are_refused(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  assert_refused(&b, "a.ply", "ply", VT_BAD_INPUT, "a.ply: is no mesh");
  vt_mesh mesh = grow_mesh(b.context, 10, true, false), none;
  assert_int_equal(vt_read_mesh(b.context, in_folder(&b, "none.obj"), &none), VT_BAD_INPUT);
  vt_clear_error(b.context);
  assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "a.ply")), VT_FAILED);
  vt_clear_error(b.context);
  assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "none/a.obj")), VT_FAILED);
  vt_clear_error(b.context);
  assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "none/a.glb")), VT_FAILED);
  vt_clear_error(b.context);
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void wrong_obj_files_are_refused_with_their_line(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 64 << 20);
  const char *bad[][2] = {{"", "holds no faces"},
                          {"v 0 0 0\nv 1 0 0\n", "holds no faces"},
                          {"v 0 0\n", "line 1: a vertex"},
                          {"\nv 0 0 nan\n", "line 2: a vertex"},
                          {"v 0 0 \\\n \\\n 0\nv 0 0 x", "line 4: a vertex"},
                          {"v 0 0 1e39\n", "line 1: a vertex"},
                          {"v 1 2 3 4 5\n", "line 1: a vertex"},
                          {"vt\n", "line 1: a texture"},
                          {"vn 1 2\n", "line 1: a normal"},
                          {"v 0 0 0\nf 1 1\n", "line 2: a face has fewer"},
                          {"v 0 0 0\nf\n", "line 2: a face has fewer"},
                          {"v 0 0 0\nf 1 1 2\n", "line 2: a face names"},
                          {"v 0 0 0\nf 1 1 0\n", "line 2: a face names"},
                          {"f -1 -1 -1\nv 0 0 0\n", "line 1: a face names"}, // not so far
                          {"v 0 0 0\nf 1 1 -2\n", "line 2: a face names"},
                          {"v 0 0 0\nf 1/1 1/1 1/1\n", "line 2: a face names"},
                          {"v 0 0 0\nvt 0\nf 1/1/1 1/1 1\n", "line 3: a face names"},
                          {"v 0 0 0\nf 1 1 1x\n", "line 2: a face names"},
                          {"v 0 0 0\nf 1 1 1/1/1/1\n", "line 2: a face names"},
                          {"v 0 0 0\nf 1 1 99999999999999999999999\n", "line 2: a face names"},
                          {"v 0 0 0\nf 1 1 4294967297\n", "line 2: a face names"},
                          {"\n\nmtllib none.mtl\n", "line 3: there is no such material library"},
                          {"mtllib /dev/zero\n", "line 1: there is no such material library"},
                          {"mtllib bad1.mtl\n", "bad1.mtl: line 2: is no number"},
                          {"mtllib bad2.mtl\n", "bad2.mtl: line 3: there is no such texture"},
                          {"mtllib bad3.mtl\n", "bad3.mtl: line 1: a material without a name"},
                          {"mtllib bad4.mtl\n", "bad4.mtl: line 2: a map without a file"}};
  const char *libraries[] = {"newmtl a\nKd 1 x 1\n", "newmtl a\nKd 1 1 1\nmap_Kd none.png\n", "newmtl \n",
                             "newmtl a\nmap_Kd -clamp on\n"};
  for (int i = 0; i < 4; i++) {
    char name[32];
    snprintf(name, sizeof name, "bad%d.mtl", i + 1);
    put_file(&b, name, libraries[i], strlen(libraries[i]));
  }
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_refused(&b, "a.obj", bad[i][0], VT_BAD_INPUT, bad[i][1]);
  close_bench(&b);
}

static void a_small_file_cannot_ask_for_much_memory_or_time(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 64 << 20);
  char *text = malloc(3 << 20), *to = text;
  to += sprintf(to, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf");
  for (int i = 0; i < 200000; i++) to += sprintf(to, " %d", 1 + i % 3); // a face of 200,000 corners
  to += sprintf(to, "\n");
  for (int i = 0; i < 20000; i++) to += sprintf(to, "usemtl m%d\nusemtl\nmtllib small.mtl\n", i); // none is used
  put_small_files(&b);
  double start = vt_seconds();
  assert_true(read_sound_or_refused(b.context, in_folder(&b, "small.obj"), (uint8_t *)text, strlen(text)));
  assert_true(vt_seconds() - start < 5);
  free(text);
  close_bench(&b);
}

#ifdef VT_WITH_JANSSON
static void wrong_gltf_files_are_refused_with_their_element(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 64 << 20);
#define HEAD "{\"asset\":{\"version\":\"2.0\"},"
#define NODES HEAD "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
#define MESH NODES "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
#define VIEWS "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":3}],"
#define ZEROS "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA" // 36 bytes
#define BUFFER "\"buffers\":[{\"byteLength\":39,\"uri\":\"data:a/b;base64," ZEROS "AAEC\"}]}"
#define POSITIONS "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}"
  const char *bad[][2] = {
      {"", "not valid JSON"},
      {"{\"asset\":{\"version\":\"1.0\"}}", "no glTF file of version 2"},
      {HEAD "\"scenes\":[]}", "holds no triangles"},
      {HEAD "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]}", "needs the extension KHR_draco"},
      {HEAD "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[0]}]}", "nodes[0]: has two parents"},
      {HEAD "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1,1]},{}]}", "nodes[1]: has two parents"},
      {HEAD "\"scenes\":[{\"nodes\":[7]}],\"nodes\":[{}]}", "names a node"},
      {HEAD "\"scenes\":[{\"nodes\":[0.5]}],\"nodes\":[{}]}", "names a node"},
      {HEAD "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"matrix\":[1]}]}", "nodes[0]: its matrix"},
      {NODES "\"meshes\":[]}", "nodes[0]: its mesh"},
      {NODES "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":-1}}]}]}",
       "meshes[0].primitives[0]: the number"},
      {NODES "\"meshes\":[{\"primitives\":[{\"material\":0}]}]}", "meshes[0].primitives[0]: its material"},
      {MESH "\"accessors\":[]}", "accessors[0]: is sparse"},
      {MESH "\"accessors\":[{\"bufferView\":0,\"sparse\":{}}]}", "accessors[0]: is sparse"},
      {MESH VIEWS "\"accessors\":[{\"bufferView\":0,\"componentType\":5124,\"count\":3,\"type\":\"VEC3\"}]," BUFFER,
       "accessors[0]: its type"},
      {MESH VIEWS "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}]," BUFFER,
       "accessors[0]: reaches"},
      {MESH VIEWS
       "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":9007199254740991,\"type\":\"VEC3\"}]," BUFFER,
       "accessors[0]: reaches"},
      {MESH VIEWS "\"accessors\":[{\"bufferView\":0,\"byteOffset\":1,\"componentType\":5126,\"count\":3,\"type\":"
                  "\"VEC3\"}]," BUFFER,
       "accessors[0]: reaches"},
      {MESH VIEWS "\"accessors\":[{\"bufferView\":5,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}]," BUFFER,
       "bufferViews[5]: its buffer"},
      {MESH VIEWS "\"accessors\":[" POSITIONS
                  ",{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"SCALAR\"}]," BUFFER,
       "accessors[1]: reaches"},
      {MESH VIEWS "\"accessors\":[" POSITIONS
                  ",{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"SCALAR\"}]," BUFFER,
       "its indices"},
      {MESH "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":37,\"byteLength\":3}],"
            "\"accessors\":[" POSITIONS
            ",{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}]," BUFFER,
       "bufferViews[1]: reaches"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":40,\"uri\":\"data:;base64," ZEROS "\"}]}",
       "buffers[0]: has fewer"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":39}]}", "buffers[0]: has fewer"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":39,\"uri\":\"no%20.bin\"}]}",
       "/no .bin; put"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":39,\"uri\":\"/dev/zero\"}]}",
       "there is no file"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":39,\"uri\":\"http://a/b\"}]}",
       "in the network"},
      {MESH VIEWS "\"accessors\":[" POSITIONS "],\"buffers\":[{\"byteLength\":39,\"uri\":\"data:;base64,A*\"}]}",
       "no base64"},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_refused(&b, "a.gltf", bad[i][0], VT_BAD_INPUT, bad[i][1]);
  // The frame is sound: with good accessors it is read, and the same with an index too many is not.
  const char good[] =
      MESH VIEWS "\"accessors\":[" POSITIONS ",{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":"
                 "\"SCALAR\"}]," BUFFER;
  vt_mesh mesh;
  put_file(&b, "a.gltf", good, strlen(good));
  assert_int_equal(vt_read_mesh(b.context, b.path, &mesh), VT_OK);
  assert_int_equal(mesh.triangle_count, 1);
  vt_free_mesh(b.context, &mesh);
  char other[sizeof good];
  strcpy(other, good);
  memcpy(strstr(other, "AAEC"), "AAED", 4);
  assert_refused(&b, "a.gltf", other, VT_BAD_INPUT, "meshes[0].primitives[0]: an index names");
  close_bench(&b);
}

static void instances_that_do_not_fit_into_memory_are_refused(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 32 << 20);
  char *text = malloc(4 << 20), *to = text;
  to += sprintf(to, HEAD "\"scenes\":[{\"nodes\":[0");
  for (int i = 1; i < 30000; i++) to += sprintf(to, ",%d", i);
  to += sprintf(to, "]}],\"nodes\":[{\"mesh\":0}");
  for (int i = 1; i < 30000; i++) to += sprintf(to, ",{\"mesh\":0}");
  to += sprintf(
      to,
      "],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":5}]}],\"accessors\":[{\"bufferView\":0,"
      "\"componentType\":5121,\"count\":300,\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":900}],"
      "\"buffers\":[{\"byteLength\":900,\"uri\":\"data:;base64,");
  for (int i = 0; i < 300; i++) to += sprintf(to, "AAEC");
  (void)sprintf(to, "\"}]}");
  assert_refused(&b, "a.gltf", text, VT_OUT_OF_MEMORY, "a.gltf"); // 9 million triangles from 1 MB
  free(text);
  close_bench(&b);
}
#endif

// ---- seeded damage

static void damage_gives_an_error_or_a_sound_mesh(bench *b, const char *name, const uint8_t *good, size_t size,
                                                  int rounds, uint64_t seed, const char *read_name, const uint8_t *read,
                                                  size_t read_size) {
  static const char text[] = "0123456789-+.eE/ \n\\#{}[],:\"ftvnumtllib";
  vt_rng rng = vt_seed_rng(seed, 1);
  uint8_t *copy = malloc(2 * size);
  char path[256];
  int sound = 0;
  for (int round = 0; round < rounds; round++) {
    size_t length = size;
    memcpy(copy, good, size);
    for (uint32_t n = 1 + vt_random(&rng) % 3; n > 0 && length; n--) {
      size_t at = vt_random(&rng) % length, span = vt_random(&rng) % 12;
      if (span > length - at) span = length - at;
      switch (vt_random(&rng) % 6) {
      case 0:
        copy[at] ^= (uint8_t)(1u << vt_random(&rng) % 8);
        break;
      case 1:
        copy[at] = (uint8_t)vt_random(&rng);
        break;
      case 2:
      case 3:
        copy[at] = (uint8_t)text[vt_random(&rng) % (sizeof text - 1)];
        break;
      case 4: // a piece taken out
        memmove(copy + at, copy + at + span, length - at - span);
        length -= span;
        break;
      default: // a piece from elsewhere
        memmove(copy + at, copy + vt_random(&rng) % (length - span + 1), span);
      }
    }
    if (round % 50 == 49) length = vt_random(&rng) % (length + 1);
    snprintf(path, sizeof path, "%s/%s", b->folder, read_name);
    if (!read) {
      sound += read_sound_or_refused(b->context, path, copy, length);
      continue;
    }
    (void)unlink(in_folder(b, name));
    put_file(b, name, copy, length);
    sound += read_sound_or_refused(b->context, path, read, read_size);
  }
  free(copy);
  assert_true(sound > rounds / 50 && sound < rounds);
}

static void a_damaged_obj_or_mtl_file_is_an_error_or_a_sound_mesh(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 128 << 20);
  put_small_files(&b);
  const uint8_t *obj = (const uint8_t *)small_obj(), *mtl = (const uint8_t *)small_mtl();
  size_t obj_size = strlen(small_obj()), mtl_size = strlen(small_mtl());
  assert_true(read_sound_or_refused(b.context, in_folder(&b, "small.obj"), obj, obj_size));
  damage_gives_an_error_or_a_sound_mesh(&b, "small.obj", obj, obj_size, 4000, 1, "small.obj", NULL, 0);
  damage_gives_an_error_or_a_sound_mesh(&b, "small.mtl", mtl, mtl_size, 2000, 2, "small.obj", obj, obj_size);
  close_bench(&b);
}

#ifdef VT_WITH_JANSSON
static void a_damaged_glb_or_gltf_file_is_an_error_or_a_sound_mesh(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 128 << 20);
  put_small_files(&b);
  vt_mesh mesh;
  uint8_t *data;
  size_t size;
  assert_int_equal(vt_read_mesh(b.context, in_folder(&b, "small.obj"), &mesh), VT_OK);
#ifdef VT_WITH_OPENIMAGEIO
  mesh.materials[1].texture = make_leaf_texture(b.context, 4);
  mesh.materials[1].cutoff = 0.5f;
#endif
  assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "small.glb")), VT_OK);
  vt_free_mesh(b.context, &mesh);
  assert_int_equal(vt_read_file(b.context, b.path, &data, &size), VT_OK);
  damage_gives_an_error_or_a_sound_mesh(&b, "small.glb", data, size, 4000, 3, "small.glb", NULL, 0);
  vt_free(b.context, data);
  const char text[] =
      NODES "\"materials\":[{\"alphaMode\":\"BLEND\"}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},"
            "\"indices\":1,\"mode\":4,\"material\":0}]}]," VIEWS "\"accessors\":[" POSITIONS
            ",{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}]," BUFFER;
  damage_gives_an_error_or_a_sound_mesh(&b, "small.gltf", (const uint8_t *)text, strlen(text), 2000, 4, "small.gltf",
                                        NULL, 0);
  close_bench(&b);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(names_of_other_kinds_and_missing_files_are_refused),
      cmocka_unit_test(wrong_obj_files_are_refused_with_their_line),
      cmocka_unit_test(a_small_file_cannot_ask_for_much_memory_or_time),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(wrong_gltf_files_are_refused_with_their_element),
      cmocka_unit_test(instances_that_do_not_fit_into_memory_are_refused),
#endif
      cmocka_unit_test(a_damaged_obj_or_mtl_file_is_an_error_or_a_sound_mesh),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(a_damaged_glb_or_gltf_file_is_an_error_or_a_sound_mesh),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
