// mesh_gltf_write.c - a mesh as a .glb or .gltf file
// SPDX-License-Identifier: BSD-3-Clause
//
// One node, one mesh, one primitive a material, each with the vertices it uses in the order in which it uses them, so
// that the bounds of its positions are its own. All words are low byte first; every view begins at a multiple of four.
// Pictures are PNG, turned over (mesh_gltf_material.c says why). What glTF has no word for stands in the materials'
// extras as vt_thin and vt_translucency; doubleSided is what other programs need to draw a leaf.
#include "datasets-synthetic/mesh_file.h"

#include "base/base64.h"
#include "base/file.h"
#include "base/image_file.h"
#include "base/json.h"
#include <string.h>

typedef struct part { // the primitive of a material
  size_t first;       // of its triangles in glb_writer.order
  size_t triangle_count;
  uint32_t vertex_count;
  size_t positions, normals, colours, uvs, indices; // offsets in the binary chunk; SIZE_MAX: not written
  float low[3], high[3];
} part;

typedef struct glb_writer {
  vt_context *ctx;
  const vt_mesh *mesh;
  const char *path;
  int material_count;
  vt_material plain[2]; // of a mesh without materials
  const vt_material *materials;
  part *parts;            // [material_count]; owned, as all below
  uint32_t *order;        // [triangle_count] triangles, one material after the other
  uint32_t *taken, *used; // [vertex_count] which part took it last + 1, and as which of its vertices
  uint8_t **pictures;     // [material_count]
  size_t *picture_sizes, *picture_offsets;
  uint8_t *binary;
  size_t size;
  bool coloured, mapped;
} glb_writer;

static int material_of(const glb_writer *w, size_t triangle) {
  const vt_mesh *mesh = w->mesh;
  return mesh->material_count ? mesh->triangle_materials[triangle] : triangle >= mesh->solid_count;
}

// ---- the binary chunk

static void put_word(uint8_t *to, uint32_t word) {
  for (int i = 0; i < 4; i++) to[i] = (uint8_t)(word >> 8 * i);
}

static void put_floats(uint8_t *to, const float *values, int count) {
  for (int i = 0; i < count; i++) {
    uint32_t word;
    memcpy(&word, &values[i], sizeof word);
    put_word(to + 4 * i, word);
  }
}

static size_t take_room(glb_writer *w, size_t size) {
  size_t at = w->size;
  w->size = (at + size + 3) / 4 * 4;
  return at;
}

static vt_status encode_picture(glb_writer *w, int m) {
  const vt_image *from = &w->materials[m].texture;
  vt_image turned;
  vt_status status = vt_make_image(w->ctx, from->width, from->height, from->channels, &turned);
  if (status) return status;
  size_t row = (size_t)from->width * (size_t)from->channels;
  for (int y = 0; y < from->height; y++)
    memcpy(turned.pixels + (size_t)y * row, from->pixels + (size_t)(from->height - 1 - y) * row, row);
  status = vt_encode_png(w->ctx, &turned, &w->pictures[m], &w->picture_sizes[m]);
  vt_free_image(w->ctx, &turned);
  return status;
}

static void look_at_attributes(glb_writer *w) {
  for (size_t v = 0; v < w->mesh->vertex_count; v++) {
    const vt_vertex *vertex = &w->mesh->vertices[v];
    for (int c = 0; c < 3; c++) w->coloured |= vertex->albedo[c] != 1;
    w->mapped |= vertex->uv[0] != 0 || vertex->uv[1] != 0;
  }
}

static void sort_triangles(glb_writer *w) {
  const vt_mesh *mesh = w->mesh;
  for (size_t t = 0; t < mesh->triangle_count; t++) w->parts[material_of(w, t)].triangle_count++;
  for (int m = 1; m < w->material_count; m++)
    w->parts[m].first = w->parts[m - 1].first + w->parts[m - 1].triangle_count;
  for (int m = 0; m < w->material_count; m++) w->parts[m].triangle_count = 0;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    part *p = &w->parts[material_of(w, t)];
    w->order[p->first + p->triangle_count++] = (uint32_t)t;
  }
}

// Counts, offsets and the size of the chunk.
static vt_status lay_out(glb_writer *w) {
  look_at_attributes(w);
  sort_triangles(w);
  for (int m = 0; m < w->material_count; m++) {
    part *p = &w->parts[m];
    for (size_t i = 0; i < 3 * p->triangle_count; i++) {
      uint32_t v = w->mesh->triangles[w->order[p->first + i / 3]][i % 3];
      if (w->taken[v] != (uint32_t)m + 1) p->vertex_count++;
      w->taken[v] = (uint32_t)m + 1;
    }
    size_t count = p->vertex_count;
    p->positions = take_room(w, 12 * count);
    p->normals = take_room(w, 12 * count);
    p->colours = w->coloured ? take_room(w, 12 * count) : SIZE_MAX;
    p->uvs = w->mapped ? take_room(w, 8 * count) : SIZE_MAX;
    p->indices = take_room(w, 12 * p->triangle_count);
    if (!w->materials[m].texture.pixels) continue;
    vt_status status = encode_picture(w, m);
    if (status) return status;
    w->picture_offsets[m] = take_room(w, w->picture_sizes[m]);
  }
  if (w->size < UINT32_MAX / 2) return VT_OK;
  return vt_fail(w->ctx, VT_FAILED, "%s: needs more than 2 GB, which .glb readers refuse; write .obj", w->path);
}

static void fill_vertex(glb_writer *w, part *p, uint32_t at, const vt_vertex *vertex) {
  float file[3];
  vt_file_from_world(vertex->position, file);
  for (int k = 0; k < 3; k++) {
    p->low[k] = at ? fminf(p->low[k], file[k]) : file[k];
    p->high[k] = at ? fmaxf(p->high[k], file[k]) : file[k];
  }
  put_floats(w->binary + p->positions + 12 * (size_t)at, file, 3);
  vt_file_from_world(vertex->normal, file);
  put_floats(w->binary + p->normals + 12 * (size_t)at, file, 3);
  if (w->coloured) put_floats(w->binary + p->colours + 12 * (size_t)at, vertex->albedo, 3);
  if (w->mapped) put_floats(w->binary + p->uvs + 8 * (size_t)at, vertex->uv, 2);
}

static void fill_binary(glb_writer *w) {
  memset(w->taken, 0, w->mesh->vertex_count * sizeof *w->taken);
  for (int m = 0; m < w->material_count; m++) {
    part *p = &w->parts[m];
    uint32_t used = 0;
    for (size_t i = 0; i < 3 * p->triangle_count; i++) {
      uint32_t v = w->mesh->triangles[w->order[p->first + i / 3]][i % 3];
      if (w->taken[v] != (uint32_t)m + 1) {
        w->taken[v] = (uint32_t)m + 1;
        w->used[v] = used;
        fill_vertex(w, p, used++, &w->mesh->vertices[v]);
      }
      put_word(w->binary + p->indices + 4 * i, w->used[v]);
    }
    if (w->pictures[m]) memcpy(w->binary + w->picture_offsets[m], w->pictures[m], w->picture_sizes[m]);
  }
}

// ---- JSON

static void put_vector(vt_json_writer *json, const char *key, const float *values, int count) {
  vt_json_open_array(json, key);
  for (int i = 0; i < count; i++) vt_json_put_number(json, NULL, values[i]);
  vt_json_close_array(json);
}

static void put_view(vt_json_writer *json, size_t offset, size_t size, int target) {
  vt_json_open_object(json, NULL);
  vt_json_put_integer(json, "buffer", 0);
  vt_json_put_integer(json, "byteOffset", (long long)offset);
  vt_json_put_integer(json, "byteLength", (long long)size);
  if (target) vt_json_put_integer(json, "target", target);
  vt_json_close_object(json);
}

static void put_accessor(vt_json_writer *json, int *view, const char *type, int component_type, size_t count,
                         const part *bounds) {
  vt_json_open_object(json, NULL);
  vt_json_put_integer(json, "bufferView", (*view)++);
  vt_json_put_integer(json, "componentType", component_type);
  vt_json_put_integer(json, "count", (long long)count);
  vt_json_put_string(json, "type", type);
  if (bounds) {
    put_vector(json, "min", bounds->low, 3);
    put_vector(json, "max", bounds->high, 3);
  }
  vt_json_close_object(json);
}

// Views and accessors have the same numbers, part by part; pictures' views come behind.
static void put_arrays(const glb_writer *w, vt_json_writer *json) {
  int view = 0;
  vt_json_open_array(json, "accessors");
  for (int m = 0; m < w->material_count; m++) {
    const part *p = &w->parts[m];
    if (!p->triangle_count) continue;
    put_accessor(json, &view, "VEC3", 5126, p->vertex_count, p);
    put_accessor(json, &view, "VEC3", 5126, p->vertex_count, NULL);
    if (w->coloured) put_accessor(json, &view, "VEC3", 5126, p->vertex_count, NULL);
    if (w->mapped) put_accessor(json, &view, "VEC2", 5126, p->vertex_count, NULL);
    put_accessor(json, &view, "SCALAR", 5125, 3 * p->triangle_count, NULL);
  }
  vt_json_close_array(json);
  vt_json_open_array(json, "bufferViews");
  for (int m = 0; m < w->material_count; m++) {
    const part *p = &w->parts[m];
    size_t count = p->vertex_count;
    if (!p->triangle_count) continue;
    put_view(json, p->positions, 12 * count, 34962);
    put_view(json, p->normals, 12 * count, 34962);
    if (w->coloured) put_view(json, p->colours, 12 * count, 34962);
    if (w->mapped) put_view(json, p->uvs, 8 * count, 34962);
    put_view(json, p->indices, 12 * p->triangle_count, 34963);
  }
  for (int m = 0; m < w->material_count; m++)
    if (w->pictures[m]) put_view(json, w->picture_offsets[m], w->picture_sizes[m], 0);
  vt_json_close_array(json);
}

static void put_mesh(const glb_writer *w, vt_json_writer *json) {
  int accessor = 0;
  vt_json_open_array(json, "meshes");
  vt_json_open_object(json, NULL);
  vt_json_open_array(json, "primitives");
  for (int m = 0; m < w->material_count; m++) {
    if (!w->parts[m].triangle_count) continue;
    vt_json_open_object(json, NULL);
    vt_json_open_object(json, "attributes");
    vt_json_put_integer(json, "POSITION", accessor++);
    vt_json_put_integer(json, "NORMAL", accessor++);
    if (w->coloured) vt_json_put_integer(json, "COLOR_0", accessor++);
    if (w->mapped) vt_json_put_integer(json, "TEXCOORD_0", accessor++);
    vt_json_close_object(json);
    vt_json_put_integer(json, "indices", accessor++);
    vt_json_put_integer(json, "material", m);
    vt_json_close_object(json);
  }
  vt_json_close_array(json);
  vt_json_close_object(json);
  vt_json_close_array(json);
}

static void put_material(vt_json_writer *json, const vt_material *material, int texture) {
  float factor[4] = {material->albedo[0], material->albedo[1], material->albedo[2], 1};
  vt_json_open_object(json, NULL);
  vt_json_put_string(json, "name", material->name);
  vt_json_open_object(json, "pbrMetallicRoughness");
  put_vector(json, "baseColorFactor", factor, 4);
  if (texture >= 0) {
    vt_json_open_object(json, "baseColorTexture");
    vt_json_put_integer(json, "index", texture);
    vt_json_close_object(json);
  }
  vt_json_put_number(json, "metallicFactor", 0);
  vt_json_put_number(json, "roughnessFactor", material->roughness);
  vt_json_close_object(json);
  if (material->cutoff > 0 && texture >= 0) {
    vt_json_put_string(json, "alphaMode", "MASK");
    vt_json_put_number(json, "alphaCutoff", material->cutoff);
  }
  vt_json_put_bool(json, "doubleSided", material->thin);
  if (material->specular != 0.04f) {
    vt_json_open_object(json, "extensions");
    vt_json_open_object(json, "KHR_materials_specular");
    vt_json_open_array(json, "specularColorFactor");
    for (int c = 0; c < 3; c++) vt_json_put_number(json, NULL, material->specular / 0.04);
    vt_json_close_array(json);
    vt_json_close_object(json);
    vt_json_close_object(json);
  }
  vt_json_open_object(json, "extras");
  vt_json_put_bool(json, "vt_thin", material->thin);
  put_vector(json, "vt_translucency", material->translucency, 3);
  vt_json_close_object(json);
  vt_json_close_object(json);
}

static void put_materials(const glb_writer *w, vt_json_writer *json) {
  int textures = 0, view = 0;
  bool glossy = false;
  vt_json_open_array(json, "materials");
  for (int m = 0; m < w->material_count; m++) {
    put_material(json, &w->materials[m], w->pictures[m] ? textures++ : -1);
    glossy |= w->materials[m].specular != 0.04f;
    if (w->parts[m].triangle_count) view += 3 + w->coloured + w->mapped;
  }
  vt_json_close_array(json);
  if (textures) {
    vt_json_open_array(json, "textures");
    for (int i = 0; i < textures; i++) {
      vt_json_open_object(json, NULL);
      vt_json_put_integer(json, "source", i);
      vt_json_close_object(json);
    }
    vt_json_close_array(json);
    vt_json_open_array(json, "images");
    for (int i = 0; i < textures; i++) {
      vt_json_open_object(json, NULL);
      vt_json_put_integer(json, "bufferView", view + i);
      vt_json_put_string(json, "mimeType", "image/png");
      vt_json_close_object(json);
    }
    vt_json_close_array(json);
  }
  if (!glossy) return;
  vt_json_open_array(json, "extensionsUsed");
  vt_json_put_string(json, NULL, "KHR_materials_specular");
  vt_json_close_array(json);
}

static vt_status write_json(const glb_writer *w, const char *quoted_uri, char **text, size_t *size) {
  vt_json_writer json = vt_begin_json(w->ctx);
  vt_json_open_object(&json, NULL);
  vt_json_open_object(&json, "asset");
  vt_json_put_string(&json, "version", "2.0");
  vt_json_put_string(&json, "generator", "voltree " VT_VERSION);
  vt_json_close_object(&json);
  vt_json_put_integer(&json, "scene", 0);
  vt_json_put_raw(&json, "scenes", "[{\"nodes\": [0]}]");
  vt_json_put_raw(&json, "nodes", "[{\"mesh\": 0}]");
  put_mesh(w, &json);
  put_materials(w, &json);
  put_arrays(w, &json);
  vt_json_open_array(&json, "buffers");
  vt_json_open_object(&json, NULL);
  vt_json_put_integer(&json, "byteLength", (long long)w->size);
  if (quoted_uri) vt_json_put_raw(&json, "uri", quoted_uri);
  vt_json_close_object(&json);
  vt_json_close_array(&json);
  vt_json_close_object(&json);
  return vt_end_json(&json, text, size);
}

// A .gltf file carries its buffer as text.
static vt_status write_text(const glb_writer *w) {
  static const char head[] = "\"data:application/octet-stream;base64,";
  char *text = NULL, *base64 = vt_base64_encode(w->ctx, w->binary, w->size);
  size_t length = base64 ? strlen(base64) : 0, size;
  char *uri = base64 ? VT_NEW(w->ctx, char, sizeof head + length + 1) : NULL;
  vt_status status = uri ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    memcpy(uri, head, sizeof head - 1);
    memcpy(uri + sizeof head - 1, base64, length);
    uri[sizeof head - 1 + length] = '"';
    status = write_json(w, uri, &text, &size);
  }
  if (!status) status = vt_write_file(w->ctx, w->path, text, size);
  vt_free(w->ctx, base64);
  vt_free(w->ctx, uri);
  vt_free(w->ctx, text);
  return status;
}

static vt_status write_chunks(const glb_writer *w) {
  char *text;
  size_t text_size;
  vt_status status = write_json(w, NULL, &text, &text_size);
  if (status) return status;
  size_t json_size = (text_size + 3) / 4 * 4, size = 12 + 8 + json_size + 8 + w->size;
  uint8_t *file = VT_NEW(w->ctx, uint8_t, size);
  if (file) {
    memcpy(file, "glTF", 4);
    put_word(file + 4, 2);
    put_word(file + 8, (uint32_t)size);
    put_word(file + 12, (uint32_t)json_size);
    memcpy(file + 16, "JSON", 4);
    memset(file + 20, ' ', json_size);
    memcpy(file + 20, text, text_size);
    put_word(file + 20 + json_size, (uint32_t)w->size);
    memcpy(file + 24 + json_size, "BIN", 4); // and its zero
    memcpy(file + 28 + json_size, w->binary, w->size);
    status = vt_write_file(w->ctx, w->path, file, size);
  } else {
    status = VT_OUT_OF_MEMORY;
  }
  vt_free(w->ctx, file);
  vt_free(w->ctx, text);
  return status;
}

vt_status vt_write_gltf(vt_context *ctx, const vt_mesh *mesh, const char *path, bool binary) {
  glb_writer w = {.ctx = ctx, .mesh = mesh, .path = path};
  vt_fill_plain_material(&w.plain[0], false);
  vt_fill_plain_material(&w.plain[1], true);
  w.material_count = mesh->material_count ? mesh->material_count : 2;
  w.materials = mesh->material_count ? mesh->materials : w.plain;
  size_t count = (size_t)w.material_count;
  w.parts = VT_NEW(ctx, part, count);
  w.order = VT_NEW(ctx, uint32_t, mesh->triangle_count);
  w.taken = VT_NEW(ctx, uint32_t, mesh->vertex_count);
  w.used = VT_NEW(ctx, uint32_t, mesh->vertex_count);
  w.pictures = VT_NEW(ctx, uint8_t *, count);
  w.picture_sizes = VT_NEW(ctx, size_t, count);
  w.picture_offsets = VT_NEW(ctx, size_t, count);
  bool room = w.parts && w.order && w.taken && w.used && w.pictures && w.picture_sizes && w.picture_offsets;
  vt_status status = room ? lay_out(&w) : VT_OUT_OF_MEMORY;
  if (!status) {
    w.binary = VT_NEW(ctx, uint8_t, w.size);
    if (w.binary) fill_binary(&w);
    status = !w.binary ? VT_OUT_OF_MEMORY : binary ? write_chunks(&w) : write_text(&w);
  }
  for (size_t m = 0; w.pictures && m < count; m++) vt_free(ctx, w.pictures[m]);
  vt_free(ctx, w.parts);
  vt_free(ctx, w.order);
  vt_free(ctx, w.taken);
  vt_free(ctx, w.used);
  vt_free(ctx, w.pictures);
  vt_free(ctx, w.picture_sizes);
  vt_free(ctx, w.picture_offsets);
  vt_free(ctx, w.binary);
  return status;
}
