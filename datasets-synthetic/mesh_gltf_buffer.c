// mesh_gltf_buffer.c - glTF 2.0 containers: JSON and chunks, buffers, views, accessors
// SPDX-License-Identifier: BSD-3-Clause
//
//   .glb   "glTF", version 2, length; chunks: length, kind, bytes (first JSON, then BIN), all words low byte first
//   .gltf  the JSON alone; buffers are files beside it or base64 in their URI
// accessor -> view -> buffer: at each step offset and length are held against what the step below has, in such an order
// that no sum can overflow; lengths come as JSON numbers and count only if they are whole and below 2^53. A file is
// told by its first bytes, not by its name.
#include "datasets-synthetic/mesh_gltf.h"

#include "base/base64.h"
#include "base/file.h"
#include <string.h>

vt_status vt_fail_gltf(const vt_gltf *gltf, const char *list, size_t index, const char *why) {
  return vt_fail(gltf->ctx, VT_BAD_INPUT, "%s: %s[%zu]: %s", gltf->path, list, index, why);
}

const vt_json *vt_gltf_item(const vt_gltf *gltf, const char *list, size_t index) {
  return vt_json_item(vt_json_member(gltf->json, list), index);
}

int vt_gltf_whole(const vt_json *object, const char *key, size_t limit, size_t *out) {
  const vt_json *value = vt_json_member(object, key);
  if (!value) return 0;
  double number = vt_json_number(value, -1);
  if (!(number >= 0 && number < 9007199254740992.0) || floor(number) != number || (size_t)number >= limit) return -1;
  *out = (size_t)number;
  return 1;
}

bool vt_gltf_numbers(const vt_json *array, int count, double *out) {
  for (int i = 0; i < count; i++) {
    double number = vt_json_number(vt_json_item(array, (size_t)i), NAN);
    if (!isfinite(number)) return false;
    out[i] = number;
  }
  return true;
}

// ---- the container

static uint32_t word_at(const uint8_t *p) {
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static vt_status read_chunks(vt_gltf *gltf, size_t size, vt_gltf_bytes *json) {
  const uint8_t *file = gltf->file;
  if (size < 20 || word_at(file + 4) != 2 || word_at(file + 8) > size || word_at(file + 8) < 20)
    return vt_fail(gltf->ctx, VT_BAD_INPUT, "%s: is no whole .glb file of version 2; copy or export it again",
                   gltf->path);
  size = word_at(file + 8);
  for (size_t at = 12, number = 0; size - at >= 8; number++) {
    size_t length = word_at(file + at);
    uint32_t kind = word_at(file + at + 4);
    at += 8;
    if (length > size - at || (number == 0) != (kind == 0x4e4f534a)) // "JSON"
      return vt_fail_gltf(gltf, "chunks", number, "is cut off or out of order; copy or export the file again");
    if (number == 0) *json = (vt_gltf_bytes){file + at, length};
    if (number == 1 && kind == 0x004e4942) gltf->binary = (vt_gltf_bytes){file + at, length}; // "BIN"
    at += length;
  }
  return VT_OK;
}

static vt_status check_extensions(const vt_gltf *gltf) {
  static const char *const known[] = {"KHR_materials_",        "KHR_texture_transform", "EXT_mesh_gpu_instancing",
                                      "KHR_mesh_quantization", "KHR_lights_punctual",   "EXT_texture_webp"};
  const vt_json *required = vt_json_member(gltf->json, "extensionsRequired");
  for (size_t i = 0; i < vt_json_count(required); i++) {
    const char *name = vt_json_string(vt_json_item(required, i), "?");
    bool found = false;
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) found |= !strncmp(name, known[k], strlen(known[k]));
    if (!found)
      return vt_fail(gltf->ctx, VT_BAD_INPUT, "%s: needs the extension %s; export it without", gltf->path, name);
  }
  const char *version = vt_json_string(vt_json_member(vt_json_member(gltf->json, "asset"), "version"), "");
  return version[0] == '2' && version[1] == '.'
             ? VT_OK
             : vt_fail(gltf->ctx, VT_BAD_INPUT, "%s: is no glTF file of version 2; export it as glTF 2.0", gltf->path);
}

vt_status vt_open_gltf(vt_context *ctx, const char *path, vt_gltf *out) {
  *out = (vt_gltf){.ctx = ctx, .path = path};
  size_t size;
  vt_status status = vt_read_file(ctx, path, &out->file, &size);
  if (status) return status;
  vt_gltf_bytes json = {out->file, size};
  if (size >= 4 && !memcmp(out->file, "glTF", 4)) status = read_chunks(out, size, &json);
  if (!status) status = vt_parse_json(ctx, (const char *)json.bytes, json.size, path, &out->json);
  if (!status) status = check_extensions(out);
  if (!status) {
    out->buffer_count = vt_json_count(vt_json_member(out->json, "buffers"));
    out->buffers = vt_alloc(ctx, out->buffer_count, sizeof *out->buffers);
    if (!out->buffers) status = VT_OUT_OF_MEMORY;
  }
  if (status) vt_close_gltf(out);
  return status;
}

void vt_close_gltf(vt_gltf *gltf) {
  for (size_t i = 0; gltf->buffers && i < gltf->buffer_count; i++) vt_free(gltf->ctx, gltf->buffers[i].owned);
  vt_free(gltf->ctx, gltf->buffers);
  vt_free(gltf->ctx, gltf->file);
  if (gltf->json) vt_free_json(gltf->ctx, gltf->json);
  *gltf = (vt_gltf){0};
}

// ---- buffers and views

static int digit_of(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

vt_status vt_gltf_uri(vt_gltf *gltf, const char *list, size_t index, const char *uri, uint8_t **owned, size_t *size) {
  vt_context *ctx = gltf->ctx;
  *owned = NULL;
  if (!strncmp(uri, "data:", 5)) {
    const char *data = strstr(uri, ";base64,");
    if (!data) return vt_fail_gltf(gltf, list, index, "its data URI is not base64; export it with files beside");
    data += strlen(";base64,");
    return vt_base64_decode(ctx, data, strlen(data), gltf->path, owned, size);
  }
  if (strstr(uri, "://")) return vt_fail_gltf(gltf, list, index, "lies in the network; download it and name the file");
  char *name = vt_strdup(ctx, uri), *folder = vt_strdup(ctx, gltf->path), *path = NULL;
  vt_status status = name && folder ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) {
    char *to = name;
    for (const char *from = uri; *from; from++) {
      int high = *from == '%' ? digit_of(from[1]) : -1, low = high >= 0 ? digit_of(from[2]) : -1;
      *to++ = low >= 0 ? (char)(high * 16 + low) : *from;
      if (low >= 0) from += 2;
    }
    *to = 0;
    folder[vt_base_name(folder) - folder] = 0;
    path = vt_join(ctx, folder, name);
    if (!path) status = VT_OUT_OF_MEMORY;
  }
  if (!status && !vt_is_file(path))
    status =
        vt_fail(ctx, VT_BAD_INPUT, "%s: %s[%zu]: there is no file %s; put it beside", gltf->path, list, index, path);
  if (!status) status = vt_read_file(ctx, path, owned, size);
  vt_free(ctx, name);
  vt_free(ctx, folder);
  vt_free(ctx, path);
  return status;
}

static vt_status read_buffer(vt_gltf *gltf, size_t index, vt_gltf_bytes *out) {
  if (gltf->buffers[index].view.bytes) {
    *out = gltf->buffers[index].view;
    return VT_OK;
  }
  const vt_json *buffer = vt_gltf_item(gltf, "buffers", index);
  const char *uri = vt_json_string(vt_json_member(buffer, "uri"), NULL);
  size_t length = 0;
  vt_gltf_bytes all = gltf->binary;
  uint8_t *owned = NULL;
  if (vt_gltf_whole(buffer, "byteLength", SIZE_MAX, &length) != 1)
    return vt_fail_gltf(gltf, "buffers", index, "its byteLength is no whole number; export the file again");
  if (!uri && index)
    return vt_fail_gltf(gltf, "buffers", index, "has no uri, and only the first may have none; export the file again");
  if (uri) {
    vt_status status = vt_gltf_uri(gltf, "buffers", index, uri, &owned, &all.size);
    if (status) return status;
    all.bytes = owned;
  }
  if (!all.bytes || length > all.size) {
    vt_free(gltf->ctx, owned);
    return vt_fail_gltf(gltf, "buffers", index, "has fewer bytes than its byteLength says; copy the file again");
  }
  gltf->buffers[index].owned = owned;
  gltf->buffers[index].view = *out = (vt_gltf_bytes){all.bytes, length};
  return VT_OK;
}

vt_status vt_gltf_view(vt_gltf *gltf, size_t index, vt_gltf_bytes *out, size_t *stride) {
  const vt_json *view = vt_gltf_item(gltf, "bufferViews", index);
  size_t buffer, offset = 0, length, step = 0;
  if (vt_gltf_whole(view, "buffer", gltf->buffer_count, &buffer) != 1 ||
      vt_gltf_whole(view, "byteOffset", SIZE_MAX, &offset) < 0 ||
      vt_gltf_whole(view, "byteLength", SIZE_MAX, &length) != 1 || vt_gltf_whole(view, "byteStride", 253, &step) < 0)
    return vt_fail_gltf(gltf, "bufferViews", index,
                        "its buffer, offset, length or stride is not valid; export it again");
  vt_gltf_bytes bytes;
  vt_status status = read_buffer(gltf, buffer, &bytes);
  if (status) return status;
  if (offset > bytes.size || length > bytes.size - offset)
    return vt_fail_gltf(gltf, "bufferViews", index, "reaches beyond its buffer; export it again");
  *out = (vt_gltf_bytes){bytes.bytes + offset, length};
  if (stride) *stride = step;
  return VT_OK;
}

// ---- accessors

static size_t size_of_type(size_t type) { // 0: unknown
  switch (type) {
  case 5120:
  case 5121:
    return 1;
  case 5122:
  case 5123:
    return 2;
  case 5125:
  case 5126:
    return 4;
  default:
    return 0;
  }
}

vt_status vt_gltf_open_accessor(vt_gltf *gltf, size_t index, vt_gltf_accessor *out) {
  static const char *const kinds[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const vt_json *accessor = vt_gltf_item(gltf, "accessors", index);
  const char *kind = vt_json_string(vt_json_member(accessor, "type"), "");
  size_t type, count, offset = 0, view_index, stride;
  *out = (vt_gltf_accessor){0};
  for (int i = 0; i < 4; i++)
    if (!strcmp(kind, kinds[i])) out->components = i + 1;
  if (vt_json_member(accessor, "sparse") || !vt_json_member(accessor, "bufferView"))
    return vt_fail_gltf(gltf, "accessors", index, "is sparse or compressed; export it without");
  if (!out->components || vt_gltf_whole(accessor, "componentType", 5127, &type) != 1 || !size_of_type(type) ||
      vt_gltf_whole(accessor, "count", SIZE_MAX, &count) != 1 || !count ||
      vt_gltf_whole(accessor, "byteOffset", SIZE_MAX, &offset) < 0 ||
      vt_gltf_whole(accessor, "bufferView", SIZE_MAX, &view_index) != 1)
    return vt_fail_gltf(gltf, "accessors", index, "its type, count, offset or view is not valid; export it again");
  vt_gltf_bytes view;
  vt_status status = vt_gltf_view(gltf, view_index, &view, &stride);
  if (status) return status;
  size_t element = size_of_type(type) * (size_t)out->components;
  if (!stride) stride = element;
  if (offset > view.size || element > view.size - offset || count - 1 > (view.size - offset - element) / stride)
    return vt_fail_gltf(gltf, "accessors", index, "reaches beyond its view; export it again");
  out->bytes = view.bytes + offset;
  out->count = count;
  out->stride = stride;
  out->type = (int)type;
  out->normalised = vt_json_bool(vt_json_member(accessor, "normalized"), false);
  return VT_OK;
}

static float component_at(const vt_gltf_accessor *a, const uint8_t *p) {
  uint32_t bits =
      word_at((uint8_t[4]){p[0], a->type >= 5122 ? p[1] : 0, a->type >= 5125 ? p[2] : 0, a->type >= 5125 ? p[3] : 0});
  float value;
  switch (a->type) {
  case 5120:
    value = (float)(int8_t)bits;
    return a->normalised ? fmaxf(value / 127, -1) : value;
  case 5121:
    return a->normalised ? (float)bits / 255 : (float)bits;
  case 5122:
    value = (float)(int16_t)bits;
    return a->normalised ? fmaxf(value / 32767, -1) : value;
  case 5123:
    return a->normalised ? (float)bits / 65535 : (float)bits;
  case 5125:
    return a->normalised ? (float)(bits / 4294967295.0) : (float)bits;
  default:
    memcpy(&value, &bits, sizeof value);
    return value;
  }
}

void vt_gltf_floats(const vt_gltf_accessor *a, size_t i, int count, float *out) {
  const uint8_t *p = a->bytes + i * a->stride;
  size_t size = size_of_type((size_t)a->type);
  for (int k = 0; k < count && k < a->components; k++, p += size) out[k] = component_at(a, p);
}

uint32_t vt_gltf_integer(const vt_gltf_accessor *a, size_t i) {
  const uint8_t *p = a->bytes + i * a->stride;
  return a->type == 5121 ? p[0] : a->type == 5123 ? (uint32_t)p[0] | (uint32_t)p[1] << 8 : word_at(p);
}
