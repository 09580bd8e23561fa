// test_synthetic_mesh_forms.c - what the readers of meshes make of the forms that OBJ, MTL and glTF files come in
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/mesh_bench.h"

#include "base/base64.h"

// ---- OBJ

static void all_forms_of_faces_and_lines_are_read(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char *ends[] = {"\n", "\r\n", "\r"};
  for (int e = 0; e < 3; e++) {
    char text[2048] = "", *to = text;
    const char *lines[] = {"# a tree",
                           "f 1 2 3", // names what comes later
                           "v 1 2 3",
                           "v  4\t5 6  # a remark",
                           "v 7 8 \\",
                           " 10 1",
                           "vt .5",
                           "vt 0.25 0.75 0",
                           "vn 0 0 2",
                           "o x",
                           "g y z",
                           "s 1",
                           "l 1 2",
                           "p 1",
                           "f 1/1 2/2 3/1",
                           "f 1//1 2//1 3//1",
                           "f -3/-2/-1 2/1/1 3/1/1",
                           "f 1/ 2/ 3/ ",
                           "unknown words 1 2 3",
                           "",
                           "   f 1 2 3 1"};
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) to += sprintf(to, "%s%s", lines[i], ends[e]);
    vt_mesh mesh = read_text(&b, "a.obj", text);
    assert_int_equal(mesh.triangle_count, 7);
    for (size_t t = 0; t < 5; t++) {
      expect_vertex(&mesh, t, 0, 1, -3, 2); // y up in the file, z up in the world
      bool kept = mesh.vertices[mesh.triangles[t][1]].position[0] == 4;
      expect_vertex(&mesh, t, kept ? 1 : 2, 4, -6, 5); // those whose normals speak against them are turned round
      expect_vertex(&mesh, t, kept ? 2 : 1, 7, -10, 8);
    }
    const vt_vertex *v = &mesh.vertices[mesh.triangles[3][0]];
    assert_true(v->uv[0] == 0.5f && v->uv[1] == 0 && v->normal[1] == -1); // +z of the file is -y of the world
    assert_true(mesh.vertices[mesh.triangles[1][1]].uv[0] == 0.25f);
    assert_int_equal(mesh.material_count, 1);
    assert_string_equal(mesh.materials[0].name, "default");
    assert_close(mesh.materials[0].albedo[1], 0.8, 1e-6);
    vt_free_mesh(b.context, &mesh);
  }
  close_bench(&b);
}

static const char cube[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                           "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

static void missing_normals_point_away_from_a_solid(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_mesh mesh = read_text(&b, "cube.obj", cube);
  assert_true(mesh.triangle_count == 12 && mesh.solid_count == 12 && mesh.vertex_count == 8);
  for (size_t v = 0; v < 8; v++) {
    const vt_vertex *x = &mesh.vertices[v];
    double out = (x->position[0] - 0.5) * x->normal[0] + (x->position[1] + 0.5) * x->normal[1] +
                 (x->position[2] - 0.5) * x->normal[2];
    assert_true(out > 0.7); // the sum weighs the two triangles of some faces double: not along the diagonal to the bit
  }
  vt_free_mesh(b.context, &mesh);
  // The two sides of one sheet: their sum cancels, and each keeps its own.
  mesh = read_text(&b, "sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 0 -1\nvt 0 0\nvt 1 0\nf 1/1 2/1 3/1\nf 1/2 3/2 2/2\n");
  assert_true(mesh.vertex_count == 6 && mesh.solid_count == 2);
  assert_true(mesh.vertices[0].normal[2] == 1 && mesh.vertices[3].normal[2] == -1);
  vt_free_mesh(b.context, &mesh);
  mesh = read_text(&b, "line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"); // has no normal at all
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void what_does_not_close_is_thin_and_comes_last(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  char leaf[1024];
  const char *faces = strstr(cube, "f 4");
  snprintf(leaf, sizeof leaf, "%.*sv 5 0 0\nv 6 0 0\nv 6 1 1\nv 5 1 1\nusemtl leaf\nf 9 10 11 12\nusemtl bark\n%s",
           (int)(faces - cube), cube, faces);
  vt_mesh mesh = read_text(&b, "b.obj", leaf);
  assert_true(mesh.triangle_count == 14 && mesh.solid_count == 12);
  assert_string_equal(mesh.materials[mesh.triangle_materials[0]].name, "bark");
  assert_string_equal(mesh.materials[mesh.triangle_materials[13]].name, "leaf");
  vt_free_mesh(b.context, &mesh);
  *strrchr(leaf, 'f') = '#'; // the box open on one side is a solid still
  mesh = read_text(&b, "c.obj", leaf);
  assert_true(mesh.triangle_count == 12 && mesh.solid_count == 10);
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void material_words_mean_what_the_reader_says(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char mtl[] = "Kd 1 0 0\nnewmtl a\nKd 0.5 0.25 1\nKs 0.5\nNs 30\nd 0.5\nTr 1\nillum 2\nKa 1 1 1\n"
                     "newmtl b c \nKs 1 1 1\nillum 1\nPr 0.25\nNs 900\nnewmtl a\nKd 0 0 0\n";
  put_file(&b, "x y.mtl", mtl, strlen(mtl));
  vt_mesh mesh = read_text(&b, "a.obj",
                           "mtllib x y.mtl\nmtllib x y.mtl\nv 0 0 0 255 0 51\nv 1 0 0\nv 0 1 0\nusemtl b c\n"
                           "f 1 2 3\nusemtl a\nf 1 2 3\n");
  const vt_material *m = mesh.materials;
  assert_int_equal(mesh.material_count, 2);
  assert_string_equal(m[0].name, "b c");
  assert_true(m[0].specular == 0 && m[0].roughness == 0.25f && m[0].albedo[0] == 1);
  assert_close(m[1].albedo[0], 0.21404, 1e-5);
  assert_close(m[1].albedo[1], 0.05088, 1e-5);
  assert_close(m[1].specular, 0.04, 1e-6);
  assert_close(m[1].roughness, 0.5, 1e-6);
  const float *colour = mesh.vertices[mesh.triangles[0][0]].albedo; // 0..255, as one of them is larger than 1
  assert_true(colour[0] == 1 && colour[1] == 0);
  assert_close(colour[2], 0.033105, 1e-5);
  assert_true(mesh.vertices[mesh.triangles[0][1]].albedo[2] == 1); // none given
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void textures_are_found_past_options_and_foreign_paths(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_image colour = make_noise(&b, 4, 2, 3, false), leaf = make_leaf_texture(b.context, 8),
           mask = make_noise(&b, 8, 8, 1, true);
  memset(mask.pixels, 0, 32);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "bark 1.pam"), &colour), VT_OK);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "leaf.pam"), &leaf), VT_OK);
  assert_int_equal(vt_write_image(b.context, in_folder(&b, "mask.pam"), &mask), VT_OK);
  const char mtl[] =
      "newmtl bark\nKd 0 0 0\nmap_Kd -clamp on -s 1 1 1 -o 0.5 -mm 0 1 -bm 1 bark 1.pam\n"
      "newmtl alpha\nmap_Kd C:\\trees\\leaf.pam\nnewmtl masked\nmap_Kd bark 1.pam\nmap_d -imfchan l mask.pam\n"
      "newmtl white\nmap_d -imfchan m ./leaf.pam\nnewmtl both\nmap_Kd leaf.pam\nmap_d mask.pam\n";
  put_file(&b, "a.mtl", mtl, strlen(mtl));
  char text[1024];
  snprintf(text, sizeof text, "mtllib a.mtl\n%.*s", (int)(strstr(cube, "f 4") - cube), cube);
  const char *names[] = {"bark", "alpha", "masked", "white", "both"};
  for (int i = 0; i < 5; i++)
    snprintf(text + strlen(text), sizeof text - strlen(text), "usemtl %s\n%s", names[i], strstr(cube, "f 4"));
  vt_mesh mesh = read_text(&b, "a.obj", text);
  const vt_material *m = mesh.materials;
  assert_int_equal(mesh.material_count, 5);
  assert_true(m[0].texture.channels == 4 && m[0].texture.width == 4 && m[0].cutoff == 0 && m[0].albedo[0] == 1 &&
              !m[0].thin);
  assert_memory_equal(m[0].texture.pixels, colour.pixels, 3);
  assert_true(m[1].cutoff == 0.5f && m[1].thin && !memcmp(m[1].texture.pixels, leaf.pixels, 256));
  assert_true(m[2].texture.width == 8 && m[2].cutoff == 0.5f && m[2].thin);
  assert_memory_equal(m[2].texture.pixels, colour.pixels, 3);
  assert_int_equal(m[2].texture.pixels[3], 0);
  assert_int_equal(m[2].texture.pixels[4 * 40 + 3], mask.pixels[40]);
  assert_true(m[3].texture.pixels[0] == 255 && m[3].texture.pixels[3] == leaf.pixels[3]);
  assert_int_equal(m[4].texture.pixels[4 * 40 + 3], mask.pixels[40]);
  assert_int_equal(mesh.solid_count, 12);
  vt_free_mesh(b.context, &mesh);
  vt_free_image(b.context, &colour);
  vt_free_image(b.context, &leaf);
  vt_free_image(b.context, &mask);
  close_bench(&b);
}

// ---- glTF

#ifdef VT_WITH_JANSSON
// A .gltf of one mesh over a buffer of `floats` and of `data` bytes behind them; `rest` has nodes, meshes, accessors,
// views.
static vt_mesh read_gltf_of(bench *b, const float *floats, int float_count, const uint8_t *data, int byte_count,
                            const char *rest) {
  uint8_t buffer[1024];
  char text[8192];
  if (float_count) memcpy(buffer, floats, 4 * (size_t)float_count);
  if (byte_count) memcpy(buffer + 4 * float_count, data, (size_t)byte_count);
  char *base64 = vt_base64_encode(b->context, buffer, 4 * (size_t)float_count + (size_t)byte_count);
  snprintf(text, sizeof text,
           "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"buffers\":[{\"byteLength\":%d,"
           "\"uri\":\"data:application/octet-stream;base64,%s\"}],%s}",
           4 * float_count + byte_count, base64, rest);
  vt_free(b->context, base64);
  return read_text(b, "a.gltf", text);
}

static const float corner_floats[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}; // two triangles of a square in x, y

static void nodes_carry_their_meshes_and_mirrors_turn_them(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const uint8_t indices[] = {0, 1, 2};
  vt_mesh mesh = read_gltf_of(
      &b, corner_floats, 12, indices, 3,
      "\"scenes\":[{\"nodes\":[0,2,3]}],\"nodes\":[{\"translation\":[10,0,0],\"scale\":[2,2,2],\"children\":[1]},"
      "{\"mesh\":0,\"rotation\":[0,0,0.70710678,0.70710678]},{\"mesh\":0,\"matrix\":[-1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]}"
      ","
      "{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
      "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
      "{\"bufferView\":1,\"componentType\":5121,\"count\":3,\"type\":\"SCALAR\"}],"
      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":3}]");
  assert_true(mesh.triangle_count == 3 && mesh.vertex_count == 9); // the fourth position is used by none
  expect_vertex(&mesh, 0, 0, 10, 0, 0);                            // file (10, 0, 0)
  expect_vertex(&mesh, 0, 1, 10, 0, 2);                            // x turned to y, doubled: file (10, 2, 0)
  expect_vertex(&mesh, 0, 2, 8, 0, 0);
  expect_vertex(&mesh, 1, 0, 0, -5, 0);
  expect_vertex(&mesh, 1, 1, 0, -5, 1); // the mirrored one is turned round
  expect_vertex(&mesh, 1, 2, -1, -5, 0);
  expect_vertex(&mesh, 2, 1, 1, 0, 0);
  for (int t = 0; t < 3; t++) assert_close(mesh.vertices[mesh.triangles[t][0]].normal[1], -1, 1e-6);
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void gpu_instances_are_put_where_their_attributes_say(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  float floats[18];
  memcpy(floats, corner_floats, sizeof corner_floats);
  const float moves[] = {1, 2, 3, 4, 5, 6};
  memcpy(floats + 12, moves, sizeof moves);
  vt_mesh mesh = read_gltf_of(
      &b, floats, 18, NULL, 0,
      "\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"],\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,"
      "\"scale\":[1,1,2],\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":1}}}}],"
      "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":5}]}],"
      "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
      "{\"bufferView\":0,\"byteOffset\":48,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\"}],"
      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72}]");
  assert_int_equal(mesh.triangle_count, 4); // two of a strip, twice
  expect_vertex(&mesh, 0, 0, 1, -6, 2);
  expect_vertex(&mesh, 2, 0, 4, -12, 5);
  expect_vertex(&mesh, 1, 0, 2, -6, 2);
  expect_vertex(&mesh, 1, 1, 2, -6, 3); // the second of a strip begins the other way round
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void accessors_of_all_types_are_decoded(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  // positions as signed bytes with a stride, normals as normalised shorts, uv as normalised bytes, colours as shorts
  const uint8_t data[] = {0,   0, 0,   9,    100,  0,    0,  9,   156, 100, 0, 9, // (0,0,0) (100,0,0) (-100,100,0)
                          0,   0, 0,   0,    0xff, 0x7f, 0,  0,   0,   0,   0, 0,  0xff, 0x7f, 0, 0,   0,
                          0,   0, 0,   0xff, 0x7f, 0,    0,  0,   255, 0,   0, 51, 102,  0,    0, 255, 0,
                          0,   0, 255, 255,  0,    0,    51, 51,  255, 255, 0, 0,  0,    0,    0, 0,   255,
                          255, 1, 0,   2,    0,    3,    0,  255, 255, 0,   0, 1,  0,    2,    0};
  vt_mesh mesh = read_gltf_of(
      &b, NULL, 0, data, sizeof data,
      "\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
      "\"materials\":[{\"doubleSided\":true}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":"
      "1,"
      "\"TEXCOORD_0\":2,\"COLOR_0\":3},\"indices\":4,\"mode\":6,\"material\":0}]}],"
      "\"accessors\":[{\"bufferView\":0,\"componentType\":5120,\"count\":3,\"type\":\"VEC3\"},"
      "{\"bufferView\":1,\"componentType\":5122,\"normalized\":true,\"count\":3,\"type\":\"VEC3\"},"
      "{\"bufferView\":2,\"componentType\":5121,\"normalized\":true,\"count\":3,\"type\":\"VEC2\"},"
      "{\"bufferView\":3,\"componentType\":5123,\"normalized\":true,\"count\":3,\"type\":\"VEC4\"},"
      "{\"bufferView\":3,\"byteOffset\":24,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"}],"
      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":12,\"byteStride\":4},{\"buffer\":0,\"byteOffset\":12,"
      "\"byteLength\":24,"
      "\"byteStride\":8},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":12,\"byteStride\":4},"
      "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":30}]");
  assert_true(mesh.triangle_count == 1 && mesh.solid_count == 0);
  expect_vertex(&mesh, 0, 1, 100, 0, 0);
  expect_vertex(&mesh, 0, 2, -100, 0, 100);
  assert_true(mesh.vertices[0].normal[1] == -1);
  assert_true(mesh.vertices[0].uv[0] == 0 && mesh.vertices[0].uv[1] == 1); // coordinates stay: pictures are turned over
  assert_close(mesh.vertices[1].uv[0], 0.2, 1e-6);
  assert_close(mesh.vertices[0].albedo[2], 0.2, 1e-6);
  assert_true(mesh.vertices[0].albedo[0] == 1 && mesh.vertices[1].albedo[0] == 0);
  vt_free_mesh(b.context, &mesh);
  close_bench(&b);
}

static void a_trunk_marked_as_two_sided_stays_a_solid(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  for (int i = 0; i < 2; i++) { // closed; and with a side left out, where the mark decides
    const float p[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const uint8_t faces[] = {3, 2, 1, 3, 1, 0, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5,
                             2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7, 4, 5, 6, 4, 6, 7};
    char rest[1024];
    snprintf(
        rest, sizeof rest,
        "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"materials\":[{\"doubleSided\":true}],\"meshes\":"
        "[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0}]}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"},{\"bufferView\":0,\"byteOffset\":96,"
        "\"componentType\":5121,\"count\":%d,\"type\":\"SCALAR\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":132}]",
        i ? 30 : 36);
    vt_mesh mesh = read_gltf_of(&b, &p[0][0], 24, faces, 36, rest);
    assert_int_equal(mesh.solid_count, i ? 0 : 12);
    vt_free_mesh(b.context, &mesh);
  }
  close_bench(&b);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(all_forms_of_faces_and_lines_are_read),
      cmocka_unit_test(missing_normals_point_away_from_a_solid),
      cmocka_unit_test(what_does_not_close_is_thin_and_comes_last),
      cmocka_unit_test(material_words_mean_what_the_reader_says),
      cmocka_unit_test(textures_are_found_past_options_and_foreign_paths),
#ifdef VT_WITH_JANSSON
      cmocka_unit_test(nodes_carry_their_meshes_and_mirrors_turn_them),
      cmocka_unit_test(gpu_instances_are_put_where_their_attributes_say),
      cmocka_unit_test(accessors_of_all_types_are_decoded),
      cmocka_unit_test(a_trunk_marked_as_two_sided_stays_a_solid),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
