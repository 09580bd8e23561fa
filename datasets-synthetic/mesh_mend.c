// mesh_mend.c - what files leave out of a mesh: normals, winding, which materials are thin, solids before sheets
// SPDX-License-Identifier: BSD-3-Clause
//
// Files cut vertices apart at seams of their textures, so vertices are first welded by position, to the bit.
//   Normals that are missing (zero) are the sum of the area vectors of all triangles at the place. Where that cancels,
// as between the two sides of a leaf modelled twice, the vertex' own triangles count, and then its first alone.
//   Winding follows the normals where all three of a triangle speak against it: a mirrored instance.
//   Thin or solid is a question of whole materials, and only our own files answer it. A material is thin
//   - if its texture has holes (cutoff > 0), or
//   - if its triangles do not close: a triangle is open if one of its edges has no other triangle of the material
//   beside
//     it, and more than half of them are open. Leaves are nearly all rim; the tubes of branches are open at two ends
//     only.
//   - A material drawn from both sides is thin if more than a tenth of its triangles are open. The mark alone would not
//   do:
//     exporters set it for trunks too, and a solid taken for a sheet counts twice in the truth of extinction.
// An edge belongs to the list of its lower vertex; equal edges are found by sorting each list. A hash table of edges
// does the same at the price of a cache miss for every edge.
#include "datasets-synthetic/mesh_file.h"

#include <string.h>

static vt_status weld(vt_context *ctx, const vt_mesh *mesh, uint32_t *place) {
  vt_key_table table = {0};
  vt_status status = VT_OK;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    uint32_t bits[3];
    float p[3];
    for (int k = 0; k < 3; k++) p[k] = mesh->vertices[v].position[k] + 0.0f; // -0 is 0
    memcpy(bits, p, sizeof bits);
    uint32_t *value = vt_key_value(ctx, &table, bits[0], bits[1], bits[2]);
    if (!value) {
      status = VT_OUT_OF_MEMORY;
      break;
    }
    if (*value == VT_NO_VALUE) *value = (uint32_t)v;
    place[v] = *value;
  }
  vt_free(ctx, table.slots);
  return status;
}

// ---- normals and winding

static vt_vec3 area_vector(const vt_mesh *mesh, const uint32_t t[3]) { // twice the area, along the normal
  vt_vec3 p[3];
  for (int i = 0; i < 3; i++) {
    const float *q = mesh->vertices[t[i]].position;
    p[i] = vt_v3(q[0], q[1], q[2]);
  }
  return vt_cross(vt_sub(p[1], p[0]), vt_sub(p[2], p[0]));
}

static bool is_zero(const float n[3]) {
  return n[0] == 0 && n[1] == 0 && n[2] == 0;
}

typedef struct normal_sum {
  vt_vec3 around, own, first; // of the place, of the vertex, of its first triangle that has an area
  double size;                // sum of the lengths at the place
} normal_sum;

static void add_area(normal_sum *sums, const uint32_t *place, uint32_t vertex, vt_vec3 area, double length) {
  normal_sum *at = &sums[place[vertex]], *own = &sums[vertex];
  at->around = vt_add(at->around, area);
  at->size += length;
  own->own = vt_add(own->own, area);
  if (vt_dot(own->first, own->first) == 0) own->first = area;
}

static vt_status add_missing_normals(vt_context *ctx, vt_mesh *mesh, const uint32_t *place) {
  size_t missing = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++) missing += is_zero(mesh->vertices[v].normal);
  if (!missing) return VT_OK;
  normal_sum *sums = VT_NEW(ctx, normal_sum, mesh->vertex_count);
  if (!sums) return VT_OUT_OF_MEMORY;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    vt_vec3 area = area_vector(mesh, mesh->triangles[t]);
    double length = vt_length(area);
    for (int i = 0; i < 3; i++) add_area(sums, place, mesh->triangles[t][i], area, length);
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    float *normal = mesh->vertices[v].normal;
    if (!is_zero(normal)) continue;
    const normal_sum *at = &sums[place[v]];
    double little = 1e-6 * at->size;
    vt_vec3 n = vt_length(at->around) > little    ? at->around
                : vt_length(sums[v].own) > little ? sums[v].own
                                                  : sums[v].first;
    n = vt_normalise(n);
    if (vt_dot(n, n) < 0.5) n = vt_v3(0, 0, 1); // all its triangles are lines or points
    normal[0] = (float)n.x, normal[1] = (float)n.y, normal[2] = (float)n.z;
  }
  vt_free(ctx, sums);
  return VT_OK;
}

static void turn_to_normals(vt_mesh *mesh) {
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    uint32_t *triangle = mesh->triangles[t], kept = triangle[1];
    vt_vec3 area = area_vector(mesh, triangle);
    int against = 0;
    for (int i = 0; i < 3; i++) {
      const float *n = mesh->vertices[triangle[i]].normal;
      against += vt_dot(area, vt_v3(n[0], n[1], n[2])) < 0;
    }
    if (against == 3) triangle[1] = triangle[2], triangle[2] = kept;
  }
}

// ---- thin or solid

typedef struct edge {
  uint32_t high, triangle, material;
} edge; // in the list of its lower vertex

static int compare_edges(const void *a, const void *b) {
  const edge *x = a, *y = b;
  if (x->high != y->high) return x->high < y->high ? -1 : 1;
  if (x->material != y->material) return x->material < y->material ? -1 : 1;
  return x->triangle < y->triangle ? -1 : x->triangle > y->triangle;
}

static void sort_edges(edge *edges, size_t count) {
  if (count > 32) {
    qsort(edges, count, sizeof *edges, compare_edges);
    return;
  }
  for (size_t i = 1; i < count; i++) {
    edge kept = edges[i];
    size_t k = i;
    for (; k && compare_edges(&kept, &edges[k - 1]) < 0; k--) edges[k] = edges[k - 1];
    edges[k] = kept;
  }
}

// Calls that see each edge of each triangle twice in the same order: to count the lists, then to fill them.
static void list_edges(const vt_mesh *mesh, const uint32_t *place, size_t *starts, edge *edges_or_null) {
  for (size_t t = 0; t < mesh->triangle_count; t++)
    for (int i = 0; i < 3; i++) {
      uint32_t a = place[mesh->triangles[t][i]], b = place[mesh->triangles[t][(i + 1) % 3]];
      if (a == b) continue; // an edge without length
      uint32_t low = a < b ? a : b, high = a < b ? b : a;
      if (edges_or_null)
        edges_or_null[starts[low]++] = (edge){high, (uint32_t)t, mesh->triangle_materials[t]};
      else
        starts[low + 1]++;
    }
}

static vt_status find_open(vt_context *ctx, const vt_mesh *mesh, const uint32_t *place, bool *open) {
  size_t *starts = VT_NEW(ctx, size_t, mesh->vertex_count + 1);
  edge *edges = VT_NEW(ctx, edge, 3 * mesh->triangle_count);
  vt_status status = starts && edges ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    list_edges(mesh, place, starts, NULL);
    for (size_t v = 0; v < mesh->vertex_count; v++) starts[v + 1] += starts[v];
    list_edges(mesh, place, starts, edges); // each start moves to its list's end
    for (size_t v = 0, begin = 0; v < mesh->vertex_count; begin = starts[v++]) {
      size_t count = starts[v] - begin;
      edge *list = edges + begin;
      sort_edges(list, count);
      for (size_t i = 0, end; i < count; i = end) {
        for (end = i + 1; end < count; end++)
          if (list[end].high != list[i].high || list[end].material != list[i].material) break;
        if (end == i + 1) open[list[i].triangle] = true;
      }
    }
  }
  vt_free(ctx, starts);
  vt_free(ctx, edges);
  return status;
}

static vt_status find_thin(vt_context *ctx, vt_mesh *mesh, const uint32_t *place, const vt_sides *sides) {
  size_t materials = (size_t)mesh->material_count;
  bool *open = VT_NEW(ctx, bool, mesh->triangle_count);
  size_t(*counts)[2] = vt_alloc(ctx, materials, sizeof *counts); // all and open triangles
  vt_status status = open && counts ? find_open(ctx, mesh, place, open) : VT_OUT_OF_MEMORY;
  for (size_t t = 0; !status && t < mesh->triangle_count; t++) {
    counts[mesh->triangle_materials[t]][0]++;
    counts[mesh->triangle_materials[t]][1] += open[t];
  }
  for (size_t m = 0; !status && m < materials; m++) {
    vt_material *material = &mesh->materials[m];
    bool rim = counts[m][1] * (sides[m] == VT_SIDES_BOTH ? 10 : 2) > counts[m][0];
    material->thin = sides[m] == VT_SIDES_THIN || (sides[m] != VT_SIDES_SOLID && (material->cutoff > 0 || rim));
  }
  vt_free(ctx, open);
  vt_free(ctx, counts);
  return status;
}

static vt_status put_solids_first(vt_context *ctx, vt_mesh *mesh) {
  uint32_t(*triangles)[3] = vt_alloc(ctx, mesh->triangle_count, sizeof *triangles);
  uint16_t *materials = VT_NEW(ctx, uint16_t, mesh->triangle_count);
  if (!triangles || !materials) {
    vt_free(ctx, triangles);
    vt_free(ctx, materials);
    return VT_OUT_OF_MEMORY;
  }
  size_t at = 0;
  for (int thin = 0; thin < 2; thin++) {
    for (size_t t = 0; t < mesh->triangle_count; t++) {
      uint16_t material = mesh->triangle_materials[t];
      if (mesh->materials[material].thin != thin) continue;
      memcpy(triangles[at], mesh->triangles[t], sizeof triangles[at]);
      materials[at++] = material;
    }
    if (!thin) mesh->solid_count = at;
  }
  vt_free(ctx, mesh->triangles);
  vt_free(ctx, mesh->triangle_materials);
  mesh->triangles = triangles;
  mesh->triangle_materials = materials;
  mesh->triangle_capacity = mesh->triangle_count;
  return VT_OK;
}

vt_status vt_mend_mesh(vt_context *ctx, vt_mesh *mesh, const vt_sides *sides) {
  uint32_t *place = VT_NEW(ctx, uint32_t, mesh->vertex_count);
  vt_status status = place ? weld(ctx, mesh, place) : VT_OUT_OF_MEMORY;
  if (!status) status = add_missing_normals(ctx, mesh, place);
  if (!status) turn_to_normals(mesh);
  if (!status) status = find_thin(ctx, mesh, place, sides);
  if (!status) status = put_solids_first(ctx, mesh);
  vt_free(ctx, place);
  return status;
}
