// mesh_file.h - what the readers and writers of meshes share
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_FILE_H
#define VT_DATASETS_SYNTHETIC_MESH_FILE_H

#include "datasets-synthetic/mesh.h"

vt_status vt_read_obj(vt_context *, const char *path, vt_mesh *out);
vt_status vt_read_gltf(vt_context *, const char *path, vt_mesh *out);
vt_status vt_write_obj(vt_context *, const vt_mesh *, const char *path);
vt_status vt_write_gltf(vt_context *, const vt_mesh *, const char *path,
                        bool binary); // .glb; else .gltf, all in one file

// ---- a table from three words to one

#define VT_NO_VALUE UINT32_MAX
typedef struct vt_key_slot {
  uint32_t key[3], value;
} vt_key_slot;
typedef struct vt_key_table {
  size_t count, capacity; // a power of two, or 0
  vt_key_slot *slots;     // owned; free with vt_free
} vt_key_table;
// The value behind the key, VT_NO_VALUE if it was not there yet: the caller then puts one. Valid until the next call.
// NULL only without memory.
uint32_t *vt_key_value(vt_context *, vt_key_table *, uint32_t a, uint32_t b, uint32_t c);
uint32_t *vt_name_value(vt_context *, vt_key_table *, const char *name, size_t length); // the key is a hash of the name
uint32_t vt_find_name(const vt_key_table *, const char *name, size_t length); // VT_NO_VALUE if it is not there

// ---- meshes that come from outside

// As vt_reserve_mesh, for counts that a file chose: VT_OUT_OF_MEMORY naming it before the memory of the machine is
// gone.
vt_status vt_reserve_read(vt_context *, const char *path, vt_mesh *, size_t vertex_count, size_t triangle_count);

typedef enum vt_sides { // what a file says of a material
  VT_SIDES_UNSAID,
  VT_SIDES_BOTH, // drawn from both sides; half of the exporters say so of all materials
  VT_SIDES_SOLID,
  VT_SIDES_THIN // our own files say it outright
} vt_sides;
// Makes a mesh that was just read keep the promises of vt_mesh: normals where they are zero, winding, material.thin by
// sides[material_count], solid triangles first. VT_OUT_OF_MEMORY.
vt_status vt_mend_mesh(vt_context *, vt_mesh *, const vt_sides *sides);

vt_status vt_make_rgba(vt_context *, vt_image *);      // of three channels, in place
bool vt_has_holes(const vt_image *rgba, float cutoff); // some texel's alpha, 0..1, is below it
// A mesh without materials has two: of its solid and of its thin triangles.
void vt_fill_plain_material(vt_material *out, bool thin);

// World is z up, files are y up: a quarter turn about x. Adding 0 makes -0 a plain zero.
static inline void vt_world_from_file(const float file[3], float world[3]) {
  float x = file[0], y = file[1], z = file[2];
  world[0] = x, world[1] = 0.0f - z, world[2] = y;
}
static inline void vt_file_from_world(const float world[3], float file[3]) {
  float x = world[0], y = world[1], z = world[2];
  file[0] = x, file[1] = z, file[2] = 0.0f - y;
}

// Length 1. What is one already to a float's precision stays as it is, bit for bit; what has no direction becomes zero.
void vt_make_unit(float normal[3]);

// Dielectrics reflect 0..8 % at normal incidence: what OBJ files call specular, 0..1, is the share of that [Burley
// 2012].
#define VT_SPECULAR_OF_KS 0.08

static inline double vt_linear_from_srgb(double v) {
  return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}
static inline double vt_srgb_from_linear(double v) {
  return v <= 0.04045 / 12.92 ? v * 12.92 : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

#endif
