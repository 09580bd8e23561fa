// test_synthetic_trees.c - grown trees of each kind: wood, leaves, materials, and that they differ as the species do
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/grow.h"
#include "datasets-synthetic/leaf_shapes.h"
#include "datasets-synthetic/leaves.h"
#include "datasets-synthetic/synthetic.h"
#include "datasets-synthetic/tree.h"
#include "tests/unit.h"

enum { KIND_COUNT = 6 };

static const vt_synthetic_kind kinds[KIND_COUNT] = {VT_SYNTHETIC_TREE,      VT_SYNTHETIC_OAK,   VT_SYNTHETIC_PINE,
                                                    VT_SYNTHETIC_SMALL_OAK, VT_SYNTHETIC_BIRCH, VT_SYNTHETIC_WILLOW};

static vt_context *make_context(int threads, uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.max_memory = max_memory, desc.log_level = VT_LOG_QUIET;
  vt_context *ctx = vt_create_context(&desc);
  assert_non_null(ctx);
  return ctx;
}

static vt_mesh grow(vt_context *ctx, vt_synthetic_kind kind, uint32_t seed, int leaf_count) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.seed = seed, desc.leaf_count = leaf_count;
  vt_mesh mesh;
  assert_int_equal(vt_make_synthetic_mesh(ctx, &desc, &mesh), VT_OK);
  return mesh;
}

static vt_vec3 position(const vt_mesh *mesh, size_t triangle, int corner) {
  const float *p = mesh->vertices[mesh->triangles[triangle][corner]].position;
  return vt_v3(p[0], p[1], p[2]);
}

static double area(const vt_mesh *mesh, size_t t) {
  vt_vec3 a = position(mesh, t, 0), b = position(mesh, t, 1), c = position(mesh, t, 2);
  return 0.5 * vt_length(vt_cross(vt_sub(b, a), vt_sub(c, a)));
}

// ---- leaves

static size_t leaf_triangles(vt_synthetic_kind kind, uint32_t seed) {
  const vt_foliage *foliage = &vt_habit_of(kind)->foliage;
  size_t vertices, triangles;
  vt_count_leaf(vt_form_of_seed(foliage, seed), foliage->stalked, &vertices, &triangles);
  return triangles;
}

static void a_tree_has_the_leaves_asked_for_or_as_many_as_its_kind_has(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    size_t each = leaf_triangles(kinds[k], 5);
    const int counts[] = {0, 1, 777, -1};
    for (int i = 0; i < 4; i++) {
      vt_mesh mesh = grow(ctx, kinds[k], 5, counts[i]);
      size_t leaves = (mesh.triangle_count - mesh.solid_count) / each;
      assert_int_equal((mesh.triangle_count - mesh.solid_count) % each, 0);
      if (counts[i] >= 0) assert_int_equal(leaves, counts[i]);
      if (counts[i] < 0 && kinds[k] == VT_SYNTHETIC_TREE) assert_int_equal(leaves, 12000);
      if (counts[i] < 0 && kinds[k] == VT_SYNTHETIC_OAK) assert_true(leaves >= 150000);
      if (counts[i] < 0 && kinds[k] == VT_SYNTHETIC_SMALL_OAK) assert_true(leaves >= 2000 && leaves < 10000);
      if (counts[i] < 0 && kinds[k] > VT_SYNTHETIC_SMALL_OAK) assert_true(leaves >= 30000);
      vt_free_mesh(ctx, &mesh);
    }
  }
  vt_destroy_context(ctx);
}

static void fewer_leaves_cover_the_same_area(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    double sums[2] = {0, 0};
    for (int i = 0; i < 2; i++) {
      vt_mesh mesh = grow(ctx, kinds[k], 2, i ? 12000 : 6000);
      for (size_t t = mesh.solid_count; t < mesh.triangle_count; t++) sums[i] += area(&mesh, t);
      vt_free_mesh(ctx, &mesh);
    }
    assert_close(sums[1] / sums[0], 1, 0.1);
  }
  vt_destroy_context(ctx);
}

static void leaves_face_their_normals_and_each_differs_in_colour(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 3, 500);
    size_t each = leaf_triangles(kinds[k], 3);
    float least = 1, most = 0;
    for (size_t t = mesh.solid_count; t < mesh.triangle_count; t++) {
      vt_vec3 a = position(&mesh, t, 0), mean = {0, 0, 0};
      for (int i = 0; i < 3; i++) {
        const vt_vertex *v = &mesh.vertices[mesh.triangles[t][i]];
        mean = vt_add(mean, vt_v3(v->normal[0], v->normal[1], v->normal[2]));
      }
      vt_vec3 face = vt_cross(vt_sub(position(&mesh, t, 1), a), vt_sub(position(&mesh, t, 2), a));
      assert_true(vt_dot(mean, face) > 0);
      float green = mesh.vertices[mesh.triangles[t][0]].albedo[1]; // of the same vertex of each leaf
      if ((t - mesh.solid_count) % each == 0) least = fminf(least, green), most = fmaxf(most, green);
    }
    assert_true(most > 1.4f * least);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

// ---- wood

static uint64_t edge_hash(uint64_t a, uint64_t b) { // splitmix64 of the pair
  uint64_t x = (a << 32 | b) + 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u, x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

// Every edge is run through as often in one direction as in the other, and the volume is that of an outside seen from
// outside.
static void wood_is_closed(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 7, 0);
    uint64_t there = 0, back = 0;
    double volume = 0;
    assert_true(mesh.solid_count > 1000);
    assert_int_equal(mesh.solid_count, mesh.triangle_count);
    for (size_t t = 0; t < mesh.solid_count; t++) {
      for (int i = 0; i < 3; i++) {
        uint32_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
        there += edge_hash(a, b), back += edge_hash(b, a);
      }
      volume += vt_dot(position(&mesh, t, 0), vt_cross(position(&mesh, t, 1), position(&mesh, t, 2))) / 6;
    }
    assert_true(there == back);
    assert_true(volume > 0.001 && volume < 0.1);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static void wood_thins_from_the_root_and_parents_come_first(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_skeleton s;
    assert_int_equal(vt_grow_skeleton(ctx, vt_habit_of(kinds[k]), 4, &s), VT_OK);
    assert_true(s.nodes[0].parent == -1);
    int wrong = 0;
    for (int n = 1; n < s.count; n++) {
      int parent = s.nodes[n].parent;
      wrong += parent < 0 || parent >= n || s.nodes[n].radius >= s.nodes[parent].radius || s.nodes[n].position.z < -0.01;
    }
    assert_int_equal(wrong, 0);
    vt_free_skeleton(ctx, &s);
  }
  vt_destroy_context(ctx);
}

// ---- materials

static void solids_come_first_and_only_leaves_are_thin(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 1, 300);
    bool met[VT_TREE_MATERIALS] = {false};
    size_t wrong = 0;
    assert_int_equal(mesh.material_count, VT_TREE_MATERIALS);
    for (size_t t = 0; t < mesh.triangle_count; t++) {
      int m = mesh.triangle_materials[t];
      wrong += m >= mesh.material_count || mesh.materials[m].thin != (t >= mesh.solid_count);
      met[m < VT_TREE_MATERIALS ? m : 0] = true;
    }
    assert_int_equal(wrong, 0);
    for (int m = 0; m < VT_TREE_MATERIALS; m++) assert_true(met[m]);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static void materials_and_vertices_are_in_range(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 9, 2000);
    size_t wrong = 0;
    for (int m = 0; m < mesh.material_count; m++) {
      const vt_material *material = &mesh.materials[m];
      assert_true(strlen(material->name) > 0 && strlen(material->name) < sizeof material->name);
      assert_true(material->specular > 0 && material->specular < 0.1f);
      assert_true(material->roughness > 0.1f && material->roughness <= 1);
      for (int c = 0; c < 3; c++) {
        assert_true(material->albedo[c] > 0.5f && material->albedo[c] < 8);
        assert_true(material->thin ? material->translucency[c] > 0.01f && material->translucency[c] < 1
                                   : material->translucency[c] == 0);
      }
      const vt_image *texture = &material->texture;
      assert_true(!texture->pixels == (m == VT_TREE_TWIG));
      if (texture->pixels) assert_true(texture->width >= 64 && texture->width <= 128 && texture->channels == 4);
      for (int i = 0; i < texture->width * texture->height; i++) wrong += texture->pixels[4 * i + 3] != 255;
    }
    for (size_t v = 0; v < mesh.vertex_count; v++) {
      const vt_vertex *vertex = &mesh.vertices[v];
      const float *n = vertex->normal;
      wrong += !(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-4f);
      for (int c = 0; c < 3; c++) wrong += !(vertex->albedo[c] > 0 && vertex->albedo[c] < 1);
    }
    for (size_t t = 0; t < mesh.triangle_count; t++)
      for (int i = 0; i < 3; i++) { // bark repeats along v
        const float *uv = mesh.vertices[mesh.triangles[t][i]].uv;
        wrong += !(uv[0] >= 0 && uv[0] <= 1 && uv[1] >= 0 && (uv[1] <= 1 || t < mesh.solid_count) && uv[1] < 1e4f);
      }
    assert_int_equal(wrong, 0);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static double linear_of(uint8_t encoded) {
  double e = encoded / 255.0;
  return e <= 0.04045 ? e / 12.92 : pow((e + 0.055) / 1.055, 2.4);
}

static void add_texel(const vt_material *m, double u, double v, double weight, double sum[3]) {
  int x = (int)(u * m->texture.width), y = (int)((1 - v) * m->texture.height);
  x = x > m->texture.width - 1 ? m->texture.width - 1 : x, y = y > m->texture.height - 1 ? m->texture.height - 1 : y;
  for (int c = 0; c < 3; c++)
    sum[c] += weight * m->albedo[c] * linear_of(m->texture.pixels[4 * (y * m->texture.width + x) + c]);
}

// Over the triangles of one leaf, by their area in the texture (which a leaf is laid out in as it is).
static void textures_change_no_mean_colour(void **state) {
  (void)state;
  enum { STEPS = 24 };
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++)
    for (uint32_t seed = 0; seed < (k ? 1u : 4u); seed++) {
      vt_mesh mesh = grow(ctx, kinds[k], seed, 1);
      const vt_material *leaf = &mesh.materials[VT_TREE_LEAF], *bark = &mesh.materials[VT_TREE_BARK];
      double sum[3] = {0, 0, 0}, bark_sum[3] = {0, 0, 0}, weight = 0;
      for (size_t t = mesh.solid_count; t < mesh.triangle_count; t++) {
        const float *a = mesh.vertices[mesh.triangles[t][0]].uv, *b = mesh.vertices[mesh.triangles[t][1]].uv,
                    *c = mesh.vertices[mesh.triangles[t][2]].uv;
        double size = fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        for (int i = 0; i < STEPS; i++)
          for (int j = 0; i + j < STEPS; j++) {
            double s = (i + 0.33) / STEPS, r = (j + 0.33) / STEPS;
            add_texel(leaf, a[0] + s * (b[0] - a[0]) + r * (c[0] - a[0]), a[1] + s * (b[1] - a[1]) + r * (c[1] - a[1]), size,
                      sum);
            weight += size;
          }
      }
      for (int i = 0; i < 128 * 128; i++) add_texel(bark, (i % 128 + 0.5) / 128, (i / 128 + 0.5) / 128, 1, bark_sum);
      for (int c = 0; c < 3; c++) {
        assert_close(sum[c] / weight, 1, 0.03);
        assert_close(bark_sum[c] / (128 * 128), 1, 1e-4);
      }
      vt_free_mesh(ctx, &mesh);
    }
  vt_destroy_context(ctx);
}

static void textures_show_veins_and_marks(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 1, 0);
    const vt_image *leaf = &mesh.materials[VT_TREE_LEAF].texture, *bark = &mesh.materials[VT_TREE_BARK].texture;
    if (kinds[k] != VT_SYNTHETIC_PINE) { // the midrib is paler than the blade beside it
      double rib = 0, blade = 0;
      for (int y = 40; y < 90; y++) rib += leaf->pixels[4 * (y * 128 + 64) + 1], blade += leaf->pixels[4 * (y * 128 + 80) + 1];
      assert_true(rib > 1.08 * blade);
    }
    int dark = 0, pale = 0;
    for (int i = 0; i < 128 * 128; i++) dark += bark->pixels[4 * i + 1] < 140, pale += bark->pixels[4 * i + 1] > 200;
    if (kinds[k] == VT_SYNTHETIC_BIRCH)
      assert_true(dark > 128 * 128 / 50 && dark < 128 * 128 / 4 && pale > 128 * 128 / 2);
    else
      assert_true(dark > 128 * 128 / 50);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static void leaves_are_green_and_only_birch_is_white(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 1; k < KIND_COUNT; k++)
    for (uint32_t seed = 0; seed < 2; seed++) {
      vt_mesh mesh = grow(ctx, kinds[k], seed, 1000);
      double sum[VT_TREE_MATERIALS][3] = {{0}}, weight[VT_TREE_MATERIALS] = {0};
      for (size_t t = 0; t < mesh.triangle_count; t++) {
        int m = mesh.triangle_materials[t];
        double size = area(&mesh, t);
        weight[m] += size;
        for (int i = 0; i < 9; i++)
          sum[m][i % 3] += size / 3 * mesh.vertices[mesh.triangles[t][i / 3]].albedo[i % 3];
      }
      const double *leaf = sum[VT_TREE_LEAF], *bark = sum[VT_TREE_BARK];
      assert_true(leaf[1] > 1.4 * leaf[0] && leaf[0] > leaf[2]);
      double green = leaf[1] / weight[VT_TREE_LEAF], grey = bark[1] / weight[VT_TREE_BARK];
      assert_true(green > 0.07 && green < 0.22);
      if (kinds[k] == VT_SYNTHETIC_BIRCH) assert_true(grey > 0.27 && grey < 0.6);
      else assert_true(grey > 0.05 && grey < 0.22);
      vt_free_mesh(ctx, &mesh);
    }
  vt_destroy_context(ctx);
}

// ---- the whole tree

typedef struct bounds { double low[3], high[3]; } bounds;

// Of what stands between two heights.
static bounds measure(const vt_mesh *mesh, double from, double to) {
  bounds b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *p = mesh->vertices[v].position;
    if (p[2] < from || p[2] > to) continue;
    for (int c = 0; c < 3; c++) b.low[c] = fmin(b.low[c], p[c]), b.high[c] = fmax(b.high[c], p[c]);
  }
  return b;
}

static double width_of(const vt_mesh *mesh, double from, double to) {
  bounds b = measure(mesh, from, to);
  return 0.5 * (b.high[0] - b.low[0] + b.high[1] - b.low[1]);
}

static void trees_are_centred_and_two_units_high(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh mesh = grow(ctx, kinds[k], 11, 1500);
    bounds b = measure(&mesh, -9, 9);
    for (int c = 0; c < 3; c++) assert_close(b.low[c] + b.high[c], 0, 1e-5);
    assert_close(b.high[2], 1, 1e-5);
    assert_true(b.high[0] < 1.4 && b.high[1] < 1.4);
    bounds foot = measure(&mesh, -1, -0.98); // z is up: the tree stands on its trunk
    assert_true(foot.high[0] - foot.low[0] < 0.35 && foot.high[1] - foot.low[1] < 0.35);
    vt_free_mesh(ctx, &mesh);
  }
  vt_destroy_context(ctx);
}

static void crowns_have_the_outline_of_their_kind(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (uint32_t seed = 0; seed < 3; seed++) {
    vt_mesh oak = grow(ctx, VT_SYNTHETIC_OAK, seed, 3000), pine = grow(ctx, VT_SYNTHETIC_PINE, seed, 3000);
    vt_mesh birch = grow(ctx, VT_SYNTHETIC_BIRCH, seed, 3000), willow = grow(ctx, VT_SYNTHETIC_WILLOW, seed, 3000);
    assert_true(width_of(&oak, -1, 1) > 1.5);                                          // broad
    assert_true(width_of(&birch, -1, 1) < 0.75 * width_of(&oak, -1, 1));               // slender
    assert_true(width_of(&pine, 0.6, 1) < 0.65 * width_of(&pine, -0.6, -0.1));         // pointed
    assert_true(width_of(&oak, 0.6, 1) > 1.3 * width_of(&pine, 0.6, 1));               // and the oak is not
    assert_true(width_of(&willow, -0.7, -0.5) > 0.8);                                  // hangs almost to the ground
    assert_true(width_of(&oak, -0.9, -0.8) < 0.5 && width_of(&birch, -0.9, -0.8) < 0.5); // where those have their trunk
    vt_free_mesh(ctx, &oak);
    vt_free_mesh(ctx, &pine);
    vt_free_mesh(ctx, &birch);
    vt_free_mesh(ctx, &willow);
  }
  vt_destroy_context(ctx);
}

// ---- photographs

static vt_views photograph(vt_context *ctx, vt_synthetic_kind kind, uint32_t seed, int leaf_count, int size) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.seed = seed, desc.leaf_count = leaf_count, desc.width = desc.height = size;
  desc.train_count = 2, desc.test_count = 0, desc.supersample = 2;
  vt_views views;
  assert_int_equal(vt_make_synthetic_views(ctx, &desc, &views), VT_OK);
  return views;
}

// Share of opaque pixels among those between the first and the last covered one of their row.
static double crown_density(const vt_views *views) {
  double opaque = 0, inside = 0;
  for (int i = 0; i < views->count; i++) {
    const vt_image *p = &views->items[i].picture;
    for (int y = 0; y < p->height; y++) {
      int first = p->width, last = -1;
      for (int x = 0; x < p->width; x++)
        if (p->pixels[4 * (y * p->width + x) + 3]) first = x < first ? x : first, last = x;
      for (int x = first; x <= last; x++) opaque += p->pixels[4 * (y * p->width + x) + 3] > 229, inside++;
    }
  }
  return opaque / inside;
}

static void an_oak_is_dense_and_a_small_oak_is_seen_through(void **state) {
  (void)state;
  vt_context *ctx = make_context(2, 0);
  double densities[2];
  for (int i = 0; i < 2; i++) {
    vt_views views = photograph(ctx, i ? VT_SYNTHETIC_SMALL_OAK : VT_SYNTHETIC_OAK, 1, i ? -1 : 20000, 128);
    densities[i] = crown_density(&views);
    vt_free_views(ctx, &views);
  }
  assert_true(densities[0] > 0.6);
  assert_true(densities[1] < 0.45 && densities[1] > 0.1);
  vt_destroy_context(ctx);
}

// Squares of a plane through the trunk that something stands before or behind.
static void cast_shadow(const vt_mesh *mesh, bool shadow[32][32]) {
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *p = mesh->vertices[v].position;
    int x = (int)floor((p[0] + 1.4) / 2.8 * 32), z = (int)floor((p[2] + 1) * 15.9);
    if (x < 0 || x > 31) continue;
    shadow[z][x] = true;
  }
}

static void other_seeds_are_clearly_other_trees(void **state) {
  (void)state;
  vt_context *ctx = make_context(1, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    static bool shadows[3][32][32];
    memset(shadows, 0, sizeof shadows);
    for (uint32_t seed = 0; seed < 3; seed++) {
      vt_mesh mesh = grow(ctx, kinds[k], seed, 800);
      cast_shadow(&mesh, shadows[seed]);
      vt_free_mesh(ctx, &mesh);
    }
    for (int pair = 0; pair < 3; pair++) {
      int covered = 0, differing = 0;
      for (int i = 0; i < 32 * 32; i++) {
        bool a = (&shadows[pair][0][0])[i], b = (&shadows[(pair + 1) % 3][0][0])[i];
        covered += a || b, differing += a != b;
      }
      assert_true(covered > 150);
      assert_true(differing > covered / 12);
    }
  }
  vt_destroy_context(ctx);
}

static void same_seed_gives_same_bits_for_any_number_of_threads(void **state) {
  (void)state;
  enum { SIZE = 48 };
  vt_context *one = make_context(1, 0), *three = make_context(3, 0);
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_mesh a = grow(one, kinds[k], 6, 900), b = grow(three, kinds[k], 6, 900);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_int_equal(a.triangle_count, b.triangle_count);
    assert_memory_equal(a.vertices, b.vertices, a.vertex_count * sizeof *a.vertices);
    assert_memory_equal(a.triangles, b.triangles, a.triangle_count * sizeof *a.triangles);
    for (int m = 0; m < VT_TREE_MATERIALS; m++)
      if (a.materials[m].texture.pixels)
        assert_memory_equal(a.materials[m].texture.pixels, b.materials[m].texture.pixels, 128 * 128 * 4);
    vt_free_mesh(one, &a);
    vt_free_mesh(three, &b);
    if (kinds[k] != VT_SYNTHETIC_PINE) continue; // nothing before the light runs on threads
    vt_views first = photograph(one, kinds[k], 6, 900, SIZE), second = photograph(three, kinds[k], 6, 900, SIZE);
    for (int i = 0; i < first.count; i++)
      assert_memory_equal(first.items[i].picture.pixels, second.items[i].picture.pixels, SIZE * SIZE * 4);
    vt_free_views(one, &first);
    vt_free_views(three, &second);
  }
  vt_destroy_context(one);
  vt_destroy_context(three);
}

static void named_scenes_have_the_kinds_they_say(void **state) {
  (void)state;
  for (int k = 1; k < KIND_COUNT; k++) {
    char small[32];
    vt_synthetic_desc desc;
    snprintf(small, sizeof small, "%s_128", vt_synthetic_name(kinds[k]));
    assert_true(vt_find_scene(vt_synthetic_name(kinds[k]), &desc));
    assert_true(desc.kind == kinds[k] && desc.leaf_count == -1 && desc.light_path == VT_RAY_TRACED && desc.width == 400);
    assert_true(desc.train_count == 48 && desc.test_count == 12 && desc.supersample == 4);
    assert_true(vt_find_scene(small, &desc));
    assert_true(desc.kind == kinds[k] && desc.light_path == VT_RASTERISED && desc.width == 128);
    assert_close(10.0 * desc.leaf_count, vt_habit_of(kinds[k])->foliage.own_count, 1);
  }
}

static void growing_keeps_the_bound_of_memory(void **state) {
  (void)state;
  for (int k = 0; k < KIND_COUNT; k++)
    for (uint64_t bound = 20000; bound < 200000000; bound *= 20) {
      vt_context *ctx = make_context(1, bound);
      vt_synthetic_desc desc = vt_default_synthetic_desc();
      desc.kind = kinds[k], desc.leaf_count = 500;
      vt_mesh mesh;
      vt_status status = vt_make_synthetic_mesh(ctx, &desc, &mesh);
      assert_true(status == VT_OK || status == VT_OUT_OF_MEMORY);
      assert_true(bound > 1000000 || status == VT_OUT_OF_MEMORY);
      assert_true(status == VT_OK || mesh.vertices == NULL);
      vt_free_mesh(ctx, &mesh);
      vt_destroy_context(ctx); // asserts that nothing is left
    }
}

static void cancelling_ends_growth(void **state) {
  (void)state;
  for (int k = 0; k < KIND_COUNT; k++) {
    vt_context *ctx = make_context(1, 0);
    vt_synthetic_desc desc = vt_default_synthetic_desc();
    desc.kind = kinds[k];
    vt_mesh mesh;
    vt_cancel(ctx);
    assert_int_equal(vt_make_synthetic_mesh(ctx, &desc, &mesh), VT_CANCELLED);
    assert_null(mesh.vertices);
    vt_destroy_context(ctx);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_tree_has_the_leaves_asked_for_or_as_many_as_its_kind_has),
      cmocka_unit_test(fewer_leaves_cover_the_same_area),
      cmocka_unit_test(leaves_face_their_normals_and_each_differs_in_colour),
      cmocka_unit_test(wood_is_closed),
      cmocka_unit_test(wood_thins_from_the_root_and_parents_come_first),
      cmocka_unit_test(solids_come_first_and_only_leaves_are_thin),
      cmocka_unit_test(materials_and_vertices_are_in_range),
      cmocka_unit_test(textures_change_no_mean_colour),
      cmocka_unit_test(textures_show_veins_and_marks),
      cmocka_unit_test(leaves_are_green_and_only_birch_is_white),
      cmocka_unit_test(trees_are_centred_and_two_units_high),
      cmocka_unit_test(crowns_have_the_outline_of_their_kind),
      cmocka_unit_test(an_oak_is_dense_and_a_small_oak_is_seen_through),
      cmocka_unit_test(other_seeds_are_clearly_other_trees),
      cmocka_unit_test(same_seed_gives_same_bits_for_any_number_of_threads),
      cmocka_unit_test(named_scenes_have_the_kinds_they_say),
      cmocka_unit_test(growing_keeps_the_bound_of_memory),
      cmocka_unit_test(cancelling_ends_growth),
  };
  only_threads_for_the_thread_sanitizer();
  return cmocka_run_group_tests(tests, NULL, NULL);
}
