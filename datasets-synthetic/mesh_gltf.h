// mesh_gltf.h - the parts of a glTF file, each checked before it is handed out
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_MESH_GLTF_H
#define VT_DATASETS_SYNTHETIC_MESH_GLTF_H

#include "base/json.h"
#include "datasets-synthetic/mesh_file.h"

typedef struct vt_gltf_bytes {
  const uint8_t *bytes;
  size_t size;
} vt_gltf_bytes;

typedef struct vt_gltf {
  vt_context *ctx;
  const char *path;     // borrowed
  uint8_t *file;        // owned; the whole file
  vt_json *json;        // owned
  vt_gltf_bytes binary; // the chunk of a .glb; within file
  size_t buffer_count;
  struct {
    vt_gltf_bytes view;
    uint8_t *owned;
  } * buffers; // read when they are first asked for; owned
} vt_gltf;

vt_status vt_open_gltf(vt_context *, const char *path, vt_gltf *out);
void vt_close_gltf(vt_gltf *);
// VT_BAD_INPUT naming file and element: "tree.glb: accessors[3]: why; what to do".
vt_status vt_fail_gltf(const vt_gltf *, const char *list, size_t index, const char *why);

const vt_json *vt_gltf_item(const vt_gltf *, const char *list, size_t index); // NULL if there is none
// A member that is a whole number 0..limit - 1: 1. Not there: 0. Anything else: -1.
int vt_gltf_whole(const vt_json *object, const char *key, size_t limit, size_t *out);
// Up to `count` numbers of an array; false, and `out` as far as it came, where one is missing or not finite.
bool vt_gltf_numbers(const vt_json *array, int count, double *out);
vt_status vt_gltf_view(vt_gltf *, size_t index, vt_gltf_bytes *out, size_t *stride_or_null); // stride 0: none given
// The bytes of a URI: data:...;base64, or a file beside. The caller frees *owned.
vt_status vt_gltf_uri(vt_gltf *, const char *list, size_t index, const char *uri, uint8_t **owned, size_t *size);

typedef struct vt_gltf_accessor { // all of its elements lie inside the file
  const uint8_t *bytes;
  size_t count, stride; // count 0: not given
  int type, components; // type: 5120..5126; components of an element, 1..4
  bool normalised;
} vt_gltf_accessor;
vt_status vt_gltf_open_accessor(vt_gltf *, size_t index, vt_gltf_accessor *out);
void vt_gltf_floats(const vt_gltf_accessor *, size_t i, int count, float *out); // what it has no component for is left
uint32_t vt_gltf_integer(const vt_gltf_accessor *, size_t i);                   // of an unsigned type

// Materials of the file and, behind them, the one of primitives without any: mesh->materials holds material_count + 1.
// sides[material_count + 1]; uv_sets likewise: which TEXCOORD_n the texture wants. Both owned by the caller.
vt_status vt_gltf_materials(vt_gltf *, vt_mesh *, vt_sides **sides, int **uv_sets);
// Texture and cutoff of one of them.
vt_status vt_gltf_texture(vt_gltf *, size_t index, vt_material *);

#endif
