// mesh_file.c - meshes from and to files, by the ending, and what their readers share
// SPDX-License-Identifier: BSD-3-Clause
#include "datasets-synthetic/mesh_file.h"

#include "base/file.h"
#include <string.h>
#include <strings.h>

typedef enum mesh_format { FORMAT_UNKNOWN, FORMAT_OBJ, FORMAT_GLTF, FORMAT_GLB } mesh_format;

static mesh_format format_of(const char *path) {
  const char *dot = strrchr(vt_base_name(path), '.');
  if (!dot) return FORMAT_UNKNOWN;
  if (!strcasecmp(dot, ".obj")) return FORMAT_OBJ;
  if (!strcasecmp(dot, ".gltf")) return FORMAT_GLTF;
  return strcasecmp(dot, ".glb") ? FORMAT_UNKNOWN : FORMAT_GLB;
}

vt_status vt_read_mesh(vt_context *ctx, const char *path, vt_mesh *out) {
  memset(out, 0, sizeof *out);
  mesh_format format = format_of(path);
  if (format == FORMAT_UNKNOWN)
    return vt_fail(ctx, VT_BAD_INPUT, "%s: is no mesh that can be read; convert it to .obj, .gltf or .glb", path);
  vt_status status = format == FORMAT_OBJ ? vt_read_obj(ctx, path, out) : vt_read_gltf(ctx, path, out);
  if (status) vt_free_mesh(ctx, out);
  return status;
}

vt_status vt_write_mesh(vt_context *ctx, const vt_mesh *mesh, const char *path) {
  mesh_format format = format_of(path);
  if (format == FORMAT_UNKNOWN)
    return vt_fail(ctx, VT_FAILED, "%s: unknown kind of mesh; end its name in .obj, .gltf or .glb", path);
  if (!mesh->triangle_count)
    return vt_fail(ctx, VT_FAILED, "%s: the mesh has no triangles; give it a trunk or leaves", path);
  return format == FORMAT_OBJ ? vt_write_obj(ctx, mesh, path) : vt_write_gltf(ctx, mesh, path, format == FORMAT_GLB);
}

// ---- a table from three words to one

static uint64_t mix(uint64_t h) { // the finaliser of MurmurHash3
  h = (h ^ h >> 33) * 0xff51afd7ed558ccdull;
  h = (h ^ h >> 33) * 0xc4ceb9fe1a85ec53ull;
  return h ^ h >> 33;
}

static vt_key_slot *find_slot(vt_key_slot *slots, size_t capacity, const uint32_t key[3]) {
  uint64_t h = mix((uint64_t)key[0] << 32 | key[1]) ^ (uint64_t)key[2] * 0x9e3779b97f4a7c15ull;
  for (size_t i = (size_t)mix(h);; i++) {
    vt_key_slot *slot = &slots[i & (capacity - 1)];
    if (slot->value == VT_NO_VALUE || !memcmp(slot->key, key, sizeof slot->key)) return slot;
  }
}

static bool grow_table(vt_context *ctx, vt_key_table *table) {
  size_t capacity = table->capacity ? table->capacity * 2 : 64;
  vt_key_slot *slots = VT_NEW(ctx, vt_key_slot, capacity);
  if (!slots) return false;
  for (size_t i = 0; i < capacity; i++) slots[i].value = VT_NO_VALUE;
  for (size_t i = 0; i < table->capacity; i++)
    if (table->slots[i].value != VT_NO_VALUE) *find_slot(slots, capacity, table->slots[i].key) = table->slots[i];
  vt_free(ctx, table->slots);
  table->slots = slots;
  table->capacity = capacity;
  return true;
}

uint32_t *vt_key_value(vt_context *ctx, vt_key_table *table, uint32_t a, uint32_t b, uint32_t c) {
  const uint32_t key[3] = {a, b, c};
  if (2 * table->count >= table->capacity && !grow_table(ctx, table)) return NULL;
  vt_key_slot *slot = find_slot(table->slots, table->capacity, key);
  if (slot->value == VT_NO_VALUE) {
    memcpy(slot->key, key, sizeof key);
    table->count++;
  }
  return &slot->value;
}

static void hash_name(const char *name, size_t length, uint32_t key[3]) {
  uint64_t h = 0xcbf29ce484222325ull; // FNV-1a
  for (size_t i = 0; i < length; i++) h = (h ^ (uint8_t)name[i]) * 0x100000001b3ull;
  key[0] = (uint32_t)h, key[1] = (uint32_t)(h >> 32), key[2] = (uint32_t)length;
}

uint32_t *vt_name_value(vt_context *ctx, vt_key_table *table, const char *name, size_t length) {
  uint32_t key[3];
  hash_name(name, length, key);
  return vt_key_value(ctx, table, key[0], key[1], key[2]);
}

uint32_t vt_find_name(const vt_key_table *table, const char *name, size_t length) {
  uint32_t key[3];
  hash_name(name, length, key);
  return table->count ? find_slot(table->slots, table->capacity, key)->value : VT_NO_VALUE;
}

// ---- memory, pictures, materials

vt_status vt_reserve_read(vt_context *ctx, const char *path, vt_mesh *mesh, size_t vertex_count,
                          size_t triangle_count) {
  const size_t limit = UINT32_MAX / 2;
  if (vertex_count > limit - mesh->vertex_count || triangle_count > limit - mesh->triangle_count)
    return vt_fail(ctx, VT_OUT_OF_MEMORY, "%s: more than 2^31 vertices or triangles; reduce the model", path);
  // vt_reserve_mesh takes half as much again as there was, and an array stands beside its copy while it grows.
  size_t vertices = mesh->vertex_count + vertex_count, triangles = mesh->triangle_count + triangle_count;
  uint64_t more = 0, bound = vt_memory_bound(ctx), used = vt_bytes_in_use(ctx);
  if (vertices > mesh->vertex_capacity) more += (vertices + mesh->vertex_capacity / 2) * sizeof *mesh->vertices;
  if (triangles > mesh->triangle_capacity)
    more += (triangles + mesh->triangle_capacity / 2) * (sizeof *mesh->triangles + sizeof *mesh->triangle_materials);
  if (more > bound - (used < bound ? used : bound))
    return vt_fail(ctx, VT_OUT_OF_MEMORY,
                   "%s: its triangles do not fit into memory; raise the bound or reduce the model", path);
  return vt_reserve_mesh(ctx, mesh, vertex_count, triangle_count);
}

vt_status vt_make_rgba(vt_context *ctx, vt_image *image) {
  if (image->channels == 4) return VT_OK;
  VT_ASSERT(image->channels == 3);
  vt_image rgba;
  vt_status status = vt_make_image(ctx, image->width, image->height, 4, &rgba);
  if (status) return status;
  size_t count = (size_t)image->width * (size_t)image->height;
  for (size_t i = 0; i < count; i++) {
    memcpy(rgba.pixels + 4 * i, image->pixels + 3 * i, 3);
    rgba.pixels[4 * i + 3] = 255;
  }
  vt_free_image(ctx, image);
  *image = rgba;
  return VT_OK;
}

bool vt_has_holes(const vt_image *rgba, float cutoff) {
  size_t count = (size_t)rgba->width * (size_t)rgba->height;
  for (size_t i = 0; i < count; i++)
    if ((float)rgba->pixels[4 * i + 3] < cutoff * 255) return true;
  return false;
}

void vt_fill_plain_material(vt_material *out, bool thin) {
  *out = (vt_material){.albedo = {1, 1, 1}, .roughness = 1, .thin = thin};
  strcpy(out->name, thin ? "sheet" : "solid");
}

void vt_make_unit(float normal[3]) {
  vt_vec3 n = vt_v3(normal[0], normal[1], normal[2]);
  double length = vt_length(n);
  if (fabs(length - 1) < 1e-6) return;
  n = length > 1e-30 ? vt_scale(n, 1 / length) : vt_v3(0, 0, 0);
  normal[0] = (float)n.x, normal[1] = (float)n.y, normal[2] = (float)n.z;
}
