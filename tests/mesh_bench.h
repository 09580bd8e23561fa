// mesh_bench.h - meshes to write and read, and the bytes of small files of them
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_MESH_BENCH_H
#define VT_TESTS_MESH_BENCH_H

#include "tests/picture_bench.h"

#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/tree.h"

static inline vt_image make_leaf_texture(vt_context *ctx, int size) { // a disc of noise, and noise where it is not
  vt_image image;
  vt_rng rng = vt_seed_rng(5, 1);
  assert_int_equal(vt_make_image(ctx, size, size, 4, &image), VT_OK);
  for (int y = 0; y < size; y++)
    for (int x = 0; x < size; x++) {
      uint8_t *p = image.pixels + 4 * (y * size + x);
      for (int c = 0; c < 3; c++) p[c] = (uint8_t)vt_random(&rng);
      p[3] = hypot(x + 0.5 - 0.5 * size, y + 0.5 - 0.4 * size) < 0.4 * size ? 255 : 10;
    }
  return image;
}

// A grown tree; with materials: bark, and leaves of two kinds that take turns, one of them cut out of its texture.
static inline vt_mesh grow_mesh(vt_context *ctx, int leaf_count, bool with_materials, bool with_texture) {
  vt_mesh mesh = {0};
  assert_int_equal(vt_grow_tree(ctx, VT_SYNTHETIC_TREE, 7, leaf_count, &mesh), VT_OK);
  assert_true(mesh.solid_count > 0 && mesh.solid_count < mesh.triangle_count);
  for (int i = 0; i < mesh.material_count; i++) vt_free_image(ctx, &mesh.materials[i].texture);
  vt_free(ctx, mesh.materials);
  mesh.materials = NULL, mesh.material_count = 0;
  memset(mesh.triangle_materials, 0, mesh.triangle_count * sizeof *mesh.triangle_materials);
  if (!with_materials) return mesh;
  mesh.materials = VT_NEW(ctx, vt_material, 3);
  vt_rng rng = vt_seed_rng(9, 1);
  for (size_t v = 0; v < mesh.vertex_count; v++)
    for (int k = 0; k < 2; k++) mesh.vertices[v].uv[k] = (float)vt_random_between(&rng, -1, 2);
  mesh.material_count = 3;
  mesh.materials[0] = (vt_material){.name = "bark", .albedo = {0.1f, 0.7f, 1}, .specular = 0.04f, .roughness = 0.9f};
  mesh.materials[1] = (vt_material){.name = "upper leaf",
                                    .albedo = {0.33333f, 0.001f, 0},
                                    .roughness = 0.123456789f,
                                    .specular = 0.3f,
                                    .translucency = {0.9f, 0.8f, 0.1f},
                                    .thin = true};
  mesh.materials[2] = (vt_material){.name = "lower/leaf", .albedo = {1, 1, 0.5f}, .specular = 0.0123f, .thin = true};
  if (with_texture) {
    mesh.materials[1].texture = make_leaf_texture(ctx, 16);
    mesh.materials[1].cutoff = 0.3f;
  }
  for (size_t t = 0; t < mesh.triangle_count; t++)
    mesh.triangle_materials[t] = (uint16_t)(t < mesh.solid_count ? 0 : 1 + t / 6 % 2);
  return mesh;
}

// Reads a file, and finds all that vt_mesh promises.
static inline vt_mesh read_good(bench *b, const char *name) {
  vt_mesh mesh;
  vt_status status = vt_read_mesh(b->context, in_folder(b, name), &mesh);
  if (status) fail_msg("%s", vt_last_error(b->context));
  for (size_t v = 0; v < mesh.vertex_count; v++) {
    const float *n = mesh.vertices[v].normal;
    assert_close(sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1, 2e-6);
  }
  for (size_t t = 0; t < mesh.triangle_count; t++) {
    assert_true(mesh.triangle_materials[t] < mesh.material_count);
    assert_int_equal(mesh.materials[mesh.triangle_materials[t]].thin, t >= mesh.solid_count);
    for (int i = 0; i < 3; i++) assert_true(mesh.triangles[t][i] < mesh.vertex_count);
  }
  return mesh;
}

static inline vt_mesh read_text(bench *b, const char *name, const char *text) {
  put_file(b, name, text, strlen(text));
  return read_good(b, name);
}

static inline void expect_vertex(const vt_mesh *mesh, size_t triangle, int corner, double x, double y, double z) {
  const float *p = mesh->vertices[mesh->triangles[triangle][corner]].position;
  assert_close(p[0], x, 1e-6);
  assert_close(p[1], y, 1e-6);
  assert_close(p[2], z, 1e-6);
}

// A quad, a triangle and a concave pentagon with two materials, in about 600 bytes: to be damaged.
static inline const char *small_obj(void) {
  return "mtllib small.mtl\no tree\nv 0 0 0 1 0.5 0\nv 1 0 0\nv 1 1 0 0 0 1\nv 0 1 0\nv 0.5 0.5 \\\n 1e0\nv -.25 "
         "2.5E-1 0\n"
         "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0 1 0\nusemtl bark\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
         "usemtl leaf\nf -6//2 -5//2 -2//2\nf 1/1 2/2 3/3\ns off\ng a b\nf 1 2 3 5 4 # a remark\nf 6 1 4\n";
}
static inline const char *small_mtl(void) {
  return "newmtl bark\nKd 0.5 0.4 0.3\nKs 0.5 0.5 0.5\nNs 30\nillum 2\nnewmtl leaf\nKd 0 1 0\nPr 0.25\nvt_thin 1\n"
         "vt_translucency 0.5 0.5 0.5\n";
}

#endif
