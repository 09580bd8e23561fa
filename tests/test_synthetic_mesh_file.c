// test_synthetic_mesh_file.c - meshes written and read back; what the readers make of the forms that files come in
// SPDX-License-Identifier: BSD-3-Clause
#define _XOPEN_SOURCE 700 // mkdtemp
#include "tests/mesh_bench.h"

#include "datasets-synthetic/mesh_file.h"
#include "datasets-synthetic/mesh_polygon.h"
#include "datasets-synthetic/mesh_text.h"

// A name as the writer of OBJ files may change it.
static bool same_name(const char *a, const char *b) {
  for (; *a && *b; a++, b++)
    if (*a != *b && *a != '_' && *b != '_') return false;
  return *a == *b;
}

static int find_material(const vt_mesh *mesh, const char *name) {
  for (int m = 0; m < mesh->material_count; m++)
    if (same_name(mesh->materials[m].name, name)) return m;
  fail_msg("no material %s", name);
  return -1;
}

static void assert_same_material(const vt_material *a, const vt_material *b) {
  assert_memory_equal(a->albedo, b->albedo, sizeof a->albedo);
  assert_memory_equal(a->translucency, b->translucency, sizeof a->translucency);
  assert_true(a->specular == b->specular && a->roughness == b->roughness && a->cutoff == b->cutoff);
  assert_int_equal(a->thin, b->thin);
  assert_int_equal(!a->texture.pixels, !b->texture.pixels);
  if (!a->texture.pixels) return;
  assert_true(a->texture.width == b->texture.width && a->texture.height == b->texture.height);
  assert_int_equal(a->texture.channels, b->texture.channels);
  assert_memory_equal(a->texture.pixels, b->texture.pixels, 4 * a->texture.width * a->texture.height);
}

// The same triangles of each material in the same order, all numbers to the bit.
static void assert_same_mesh(const vt_mesh *a, const vt_mesh *b) {
  assert_int_equal(a->triangle_count, b->triangle_count);
  assert_int_equal(a->solid_count, b->solid_count);
  for (int m = 0; m < a->material_count; m++) {
    int n = find_material(b, a->materials[m].name);
    assert_same_material(&a->materials[m], &b->materials[n]);
    size_t s = 0;
    for (size_t t = 0; t < a->triangle_count; t++) {
      if (a->triangle_materials[t] != m) continue;
      while (s < b->triangle_count && b->triangle_materials[s] != n) s++;
      assert_true(s < b->triangle_count);
      for (int i = 0; i < 3; i++) {
        const vt_vertex *x = &a->vertices[a->triangles[t][i]], *y = &b->vertices[b->triangles[s][i]];
        for (int k = 0; k < 3; k++) { // not memcmp: -0 may become 0
          assert_true(x->position[k] == y->position[k] && x->normal[k] == y->normal[k]);
          assert_true(x->albedo[k] == y->albedo[k] && (k == 2 || x->uv[k] == y->uv[k]));
        }
      }
      s++;
    }
  }
}

#ifdef VT_WITH_OPENIMAGEIO
#define ROUND_TRIP_TEXTURE true
#else
#define ROUND_TRIP_TEXTURE false
#endif

static void a_grown_tree_comes_back_bit_for_bit_from_both_formats(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 2, 0);
  vt_mesh tree = grow_mesh(b.context, 1500, true, ROUND_TRIP_TEXTURE);
  assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.obj")), VT_OK);
  vt_mesh from_obj = read_good(&b, "tree.obj");
  assert_same_mesh(&tree, &from_obj);
  assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.glb")), VT_OK);
#ifdef VT_WITH_JANSSON
  vt_mesh from_glb = read_good(&b, "tree.glb");
  assert_same_mesh(&tree, &from_glb);
  assert_same_mesh(&from_obj, &from_glb);
  assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.gltf")), VT_OK);
  vt_mesh from_gltf = read_good(&b, "tree.gltf");
  assert_same_mesh(&from_glb, &from_gltf);
  vt_free_mesh(b.context, &from_gltf);
  vt_free_mesh(b.context, &from_glb);
#else
  vt_mesh none;
  assert_int_equal(vt_read_mesh(b.context, in_folder(&b, "tree.glb"), &none), VT_MISSING_PROGRAM);
  assert_null(none.vertices);
#endif
  vt_free_mesh(b.context, &from_obj);
  vt_free_mesh(b.context, &tree);
  close_bench(&b);
}

static void a_texture_is_kept_as_pam_where_no_png_can_be_written(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_mesh tree = grow_mesh(b.context, 50, true, true);
  assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.obj")), VT_OK);
  vt_mesh back = read_good(&b, "tree.obj");
  assert_same_mesh(&tree, &back);
  vt_free_mesh(b.context, &back);
#ifndef VT_WITH_OPENIMAGEIO
  assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.glb")), VT_MISSING_PROGRAM);
#endif
  vt_free_mesh(b.context, &tree);
  close_bench(&b);
}

static void a_mesh_without_materials_keeps_what_is_solid(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  vt_mesh tree = grow_mesh(b.context, 200, true, false);
  vt_free(b.context, tree.materials);
  tree.materials = NULL, tree.material_count = 0;
  const char *names[] = {"tree.obj", "tree.glb"};
  for (int i = 0; i < 2; i++) {
    assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, names[i])), VT_OK);
#ifndef VT_WITH_JANSSON
    if (i) continue;
#endif
    vt_mesh back = read_good(&b, names[i]);
    assert_int_equal(back.solid_count, tree.solid_count);
    assert_int_equal(back.material_count, 2);
    assert_same_mesh(&tree, &back); // compares counts alone
    for (size_t t = 0; t < tree.triangle_count; t++)
      for (int k = 0; k < 3; k++)
        assert_true(tree.vertices[tree.triangles[t][1]].position[k] == back.vertices[back.triangles[t][1]].position[k]);
    vt_free_mesh(b.context, &back);
  }
  vt_free_mesh(b.context, &tree);
  close_bench(&b);
}

static void the_same_mesh_gives_the_same_bytes(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 3, 0);
  vt_mesh tree = grow_mesh(b.context, 300, true, ROUND_TRIP_TEXTURE);
  const char *names[] = {"tree.obj", "tree.mtl", "tree.glb"};
  uint8_t *first[3];
  size_t first_size[3];
  for (int pass = 0; pass < 2; pass++) {
    assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.obj")), VT_OK);
    assert_int_equal(vt_write_mesh(b.context, &tree, in_folder(&b, "tree.glb")), VT_OK);
    for (int i = 0; i < 3; i++) {
      uint8_t *data;
      size_t size;
      assert_int_equal(vt_read_file(b.context, in_folder(&b, names[i]), &data, &size), VT_OK);
      if (pass) {
        assert_int_equal(size, first_size[i]);
        assert_memory_equal(data, first[i], size);
        vt_free(b.context, first[i]);
        vt_free(b.context, data);
      } else {
        first[i] = data, first_size[i] = size;
      }
    }
  }
  vt_free_mesh(b.context, &tree);
  close_bench(&b);
}

// ---- numbers

static void printed_floats_read_back_the_same_and_short(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(3, 1);
  for (int i = 0; i < 300000; i++) {
    uint32_t bits = vt_random(&rng);
    float value, strtof_value;
    char text[64];
    double back;
    memcpy(&value, &bits, sizeof value);
    if (i % 2) value = (float)vt_random_between(&rng, -3, 3);
    if (!isfinite(value)) continue;
    *vt_print_float(text, value) = 0;
    assert_true(strlen(text) <= 32);
    assert_non_null(vt_scan_number(text, &back));
    strtof_value = strtof(text, NULL);
    if ((float)back != value || strtof_value != value) fail_msg("%.9g is written %s and read %.9g", value, text, back);
  }
  const float plain[] = {0, 1, -1, 0.5f, 0.1f, -2.25f, 1000, 1e9f, 1e-7f, 123456, 0.001f, 1e30f, 9.9999999e-5f};
  const char *texts[] = {"0",   "1",         "-1",     "0.5",   "0.1",  "-2.25", "1000",
                         "1e9", "0.0000001", "123456", "0.001", "1e30", "0.0001"};
  for (size_t i = 0; i < sizeof plain / sizeof *plain; i++) {
    char text[64];
    *vt_print_float(text, plain[i]) = 0;
    assert_string_equal(text, texts[i]);
  }
}

static void numbers_are_read_as_strtod_reads_them(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(4, 1);
  for (int i = 0; i < 100000; i++) {
    char text[64];
    double value = vt_random_between(&rng, -10, 10) * pow(10, (double)(vt_random(&rng) % 60) - 30), back;
    snprintf(text, sizeof text, "%.*g", (int)(vt_random(&rng) % 25) + 1, value);
    assert_non_null(vt_scan_number(text, &back));
    assert_close(back, strtod(text, NULL), 1e-14 * fabs(value));
  }
  const char *bad[] = {"", "-", ".", "e5", "1e", "1e+", "nan", "inf", "1.2.3", "0x10", "1,5", "1e999", "--1", "1f"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    double value;
    if (vt_scan_number(bad[i], &value)) fail_msg("'%s' was read as %g", bad[i], value);
  }
  double value;
  assert_non_null(vt_scan_number("1e-99999999999999999999", &value));
  assert_true(value == 0);
  assert_non_null(vt_scan_number("000000000000000000000000000000.00000000000000000000000000000025e30", &value));
  assert_close(value, 0.25, 1e-15);
}

// ---- polygons

static double area_of(const vt_vec3 *corners, const uint32_t t[3]) { // seen from +z
  vt_vec3 a = vt_sub(corners[t[1]], corners[t[0]]), b = vt_sub(corners[t[2]], corners[t[0]]);
  return 0.5 * vt_cross(a, b).z;
}

static void concave_polygons_are_cut_along_their_rim(void **state) {
  (void)state;
  vt_rng rng = vt_seed_rng(2, 1);
  for (int round = 0; round < 2000; round++) { // stars around the origin: simple polygons, mostly concave
    vt_vec3 corners[40];
    uint32_t order[40], triangles[40][3], count = 3 + vt_random(&rng) % 38;
    double area = 0, sum = 0;
    for (uint32_t i = 0; i < count; i++) {
      double angle = 2 * VT_PI * i / count, r = vt_random_between(&rng, 0.1, 1);
      corners[i] = vt_v3(r * cos(angle), r * sin(angle), 0);
    }
    for (uint32_t i = 0; i < count; i++) area += 0.5 * vt_cross(corners[i], corners[(i + 1) % count]).z;
    vt_cut_polygon(corners, count, order, triangles);
    for (uint32_t i = 0; i + 2 < count; i++) {
      double piece = area_of(corners, triangles[i]);
      assert_true(piece >= -1e-12); // none is turned over, so none lies on another: the sum is right
      sum += piece;
    }
    assert_close(sum, area, 1e-9);
  }
}

// ---- trees made elsewhere

#ifdef VT_WITH_OPENIMAGEIO
static void trees_made_elsewhere_are_read_whole(void **state) {
  (void)state;
  bench b;
  open_bench(&b, 1, 0);
  const char *names[] = {"ash_small", "oak_small"};
  for (int i = 0; i < 2; i++) {
    char path[512];
    snprintf(path, sizeof path, "%s/meshes/%s.obj", VT_DATASETS_DIR, names[i]);
    if (!vt_is_file(path)) {
      close_bench(&b);
      skip();
    }
    uint8_t *text;
    size_t size, faces = 0;
    assert_int_equal(vt_read_file(b.context, path, &text, &size), VT_OK);
    for (size_t k = 1; k < size; k++) faces += text[k - 1] == '\n' && text[k] == 'f';
    vt_free(b.context, text);
    vt_mesh mesh, back;
    assert_int_equal(vt_read_mesh(b.context, path, &mesh), VT_OK);
    assert_int_equal(mesh.triangle_count, faces);
    assert_int_equal(mesh.material_count, 2);
    const vt_material *bark = &mesh.materials[0], *leaf = &mesh.materials[1];
    assert_true(!strcmp(bark->name, "bark") && !bark->thin && bark->cutoff == 0 && bark->texture.width == 1024);
    assert_true(!strcmp(leaf->name, "leaf") && leaf->thin && leaf->cutoff == 0.5f &&
                vt_has_holes(&leaf->texture, 0.5f));
    float low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < mesh.vertex_count; v++) {
      low = fminf(low, mesh.vertices[v].position[2]);
      high = fmaxf(high, mesh.vertices[v].position[2]);
    }
    assert_true(low > -3 && low < 1 && high > 20); // stands upright on the ground
    printf("%s: %zu vertices, %zu triangles, %zu solid, z %g to %g\n", names[i], mesh.vertex_count, mesh.triangle_count,
           mesh.solid_count, low, high);
    assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "a.glb")), VT_OK);
#ifdef VT_WITH_JANSSON
    back = read_good(&b, "a.glb");
    assert_same_mesh(&mesh, &back);
    vt_free_mesh(b.context, &back);
#endif
    assert_int_equal(vt_write_mesh(b.context, &mesh, in_folder(&b, "a.obj")), VT_OK);
    back = read_good(&b, "a.obj");
    assert_same_mesh(&mesh, &back);
    vt_free_mesh(b.context, &back);
    vt_free_mesh(b.context, &mesh);
  }
  close_bench(&b);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_grown_tree_comes_back_bit_for_bit_from_both_formats),
      cmocka_unit_test(a_texture_is_kept_as_pam_where_no_png_can_be_written),
      cmocka_unit_test(a_mesh_without_materials_keeps_what_is_solid),
      cmocka_unit_test(the_same_mesh_gives_the_same_bytes),
      cmocka_unit_test(printed_floats_read_back_the_same_and_short),
      cmocka_unit_test(numbers_are_read_as_strtod_reads_them),
      cmocka_unit_test(concave_polygons_are_cut_along_their_rim),
#ifdef VT_WITH_OPENIMAGEIO
      cmocka_unit_test(trees_made_elsewhere_are_read_whole),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
