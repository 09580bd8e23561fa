// mesh.c - the container that trees are grown into and photographed from
// SPDX-License-Identifier: BSD-3-Clause
//
// Leaves are cut out of geometry, not of textures: the outline is then exact at every distance, coverage is a matter of
// the rasteriser alone, and a ray tracer can take the same arrays as they are.

#include "datasets-synthetic/mesh.h"

void vt_free_mesh(vt_context *ctx, vt_mesh *mesh) {
  vt_free(ctx, mesh->vertices);
  vt_free(ctx, mesh->triangles);
  vt_free(ctx, mesh->triangle_materials);
  for (int i = 0; i < mesh->material_count; i++) vt_free_image(ctx, &mesh->materials[i].texture);
  vt_free(ctx, mesh->materials);
  *mesh = (vt_mesh){0};
}

static vt_status grow_array(vt_context *ctx, void **array, size_t *capacity, size_t needed, size_t size) {
  if (needed <= *capacity) return VT_OK;
  size_t roomy = needed + *capacity / 2;
  void *grown = vt_realloc(ctx, *array, roomy, size);
  if (!grown) return VT_OUT_OF_MEMORY;
  *array = grown, *capacity = roomy;
  return VT_OK;
}

vt_status vt_reserve_mesh(vt_context *ctx, vt_mesh *mesh, size_t vertex_count, size_t triangle_count) {
  size_t vertices = mesh->vertex_count + vertex_count, triangles = mesh->triangle_count + triangle_count;
  if (vertices > UINT32_MAX - 1 || triangles > UINT32_MAX - 1)
    return vt_fail(ctx, VT_OUT_OF_MEMORY, "synthetic tree: too many triangles for 32 bits; ask for fewer leaves");
  void *vertex_array = mesh->vertices, *triangle_array = mesh->triangles, *material_array = mesh->triangle_materials;
  vt_status status = grow_array(ctx, &vertex_array, &mesh->vertex_capacity, vertices, sizeof *mesh->vertices);
  mesh->vertices = vertex_array;
  if (status) return status;
  size_t capacity = mesh->triangle_capacity; // of both arrays
  status = grow_array(ctx, &material_array, &capacity, triangles, sizeof *mesh->triangle_materials);
  mesh->triangle_materials = material_array;
  if (status) return status;
  status = grow_array(ctx, &triangle_array, &mesh->triangle_capacity, triangles, sizeof *mesh->triangles);
  mesh->triangles = triangle_array;
  return status;
}

static void put(float out[3], vt_vec3 v) {
  out[0] = (float)v.x, out[1] = (float)v.y, out[2] = (float)v.z;
}

uint32_t vt_add_vertex(vt_mesh *mesh, vt_vec3 position, vt_vec3 normal, vt_vec3 albedo) {
  VT_ASSERT(mesh->vertex_count < mesh->vertex_capacity);
  vt_vertex *vertex = &mesh->vertices[mesh->vertex_count];
  put(vertex->position, position);
  put(vertex->normal, normal);
  put(vertex->albedo, albedo);
  return (uint32_t)mesh->vertex_count++;
}

void vt_add_triangle(vt_mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
  VT_ASSERT(mesh->triangle_count < mesh->triangle_capacity);
  uint32_t *triangle = mesh->triangles[mesh->triangle_count++];
  triangle[0] = a, triangle[1] = b, triangle[2] = c;
}

void vt_centre_mesh(vt_mesh *mesh, double height) {
  if (!mesh->vertex_count) return;
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t v = 0; v < mesh->vertex_count; v++)
    for (int k = 0; k < 3; k++) {
      double p = mesh->vertices[v].position[k];
      low[k] = fmin(low[k], p), high[k] = fmax(high[k], p);
    }
  double scale = high[2] > low[2] ? height / (high[2] - low[2]) : 1;
  for (size_t v = 0; v < mesh->vertex_count; v++)
    for (int k = 0; k < 3; k++) {
      float *p = &mesh->vertices[v].position[k];
      *p = (float)((*p - 0.5 * (low[k] + high[k])) * scale);
    }
}
