// mesh_obj_read.c - OBJ files: polygons over separate lists of positions, texture coordinates and normals
// SPDX-License-Identifier: BSD-3-Clause
//
// The file is gone through twice. First the lists (v, vt, vn) and the material libraries, so that a face may name what
// comes behind it; then the faces, for which an index from the end (-1 is the last one so far) needs lists counted
// again on the way. Each triple of indices that occurs is a vertex of ours. Positions may carry a colour (v x y z r g
// b), encoded as sRGB as is the habit, 0..1 or, if one is larger, 0..255. Lines, points, curves, groups and smoothing
// are passed over. No index is used and no memory asked for before it was held against what the file has.
#include "datasets-synthetic/mesh_mtl.h"
#include "datasets-synthetic/mesh_polygon.h"
#include "datasets-synthetic/mesh_text.h"

#include "base/file.h"
#include <string.h>

typedef struct triples { // a list of the file
  size_t count, capacity;
  float (*items)[3]; // owned
} triples;

enum { POSITION, TEXTURE, NORMAL, LIST_COUNT };
#define NOT_GIVEN UINT32_MAX

typedef struct corner {
  uint32_t index[LIST_COUNT];
} corner;

typedef struct obj_file {
  vt_context *ctx;
  vt_text text;
  triples lists[LIST_COUNT];
  size_t colour_count, colour_capacity; // of all positions, or 0
  double (*colours)[3];                 // owned; -1: none given. A float would lose bits of the decoded value
  double largest_colour;
  size_t seen[LIST_COUNT]; // on the second way
  vt_mtl_library library;
  vt_mesh *mesh;
  vt_sides *sides; // [material_capacity] of the mesh' materials
  size_t material_capacity;
  vt_key_table material_names, library_names, vertices;
  const char *material_name; // points into the text; its material is made when a face needs it
  size_t material_name_length;
  int material;           // -1: not made yet
  size_t corner_capacity; // of the arrays for one face
  corner *corners;        // owned, as those below
  vt_vec3 *points;
  uint32_t *order, (*triangles)[3];
} obj_file;

static float *add_triple(vt_context *ctx, triples *list) {
  if (list->count == list->capacity) {
    size_t capacity = list->capacity ? list->capacity * 2 : 1024;
    void *items = vt_realloc(ctx, list->items, capacity, sizeof *list->items);
    if (!items) return NULL;
    list->items = items;
    list->capacity = capacity;
  }
  return list->items[list->count++];
}

// ---- first way: lists and libraries

static bool take_floats(const double *values, int count, float *to) {
  for (int k = 0; k < count; k++) {
    to[k] = (float)values[k];
    if (!isfinite(to[k])) return false;
  }
  return true;
}

static vt_status add_colour(obj_file *obj, const double *rgb) { // NULL: none given
  size_t needed = obj->lists[POSITION].count;
  if (!rgb && !obj->colour_count) return VT_OK;
  if (needed > obj->colour_capacity) {
    void *colours = vt_realloc(obj->ctx, obj->colours, 2 * needed, sizeof *obj->colours);
    if (!colours) return VT_OUT_OF_MEMORY;
    obj->colours = colours;
    obj->colour_capacity = 2 * needed;
  }
  for (; obj->colour_count < needed; obj->colour_count++) // those in front had none
    for (int k = 0; k < 3; k++) obj->colours[obj->colour_count][k] = -1;
  for (int k = 0; k < 3 && rgb; k++) {
    obj->colours[needed - 1][k] = fmin(fmax(rgb[k], 0), 255);
    obj->largest_colour = fmax(obj->largest_colour, obj->colours[needed - 1][k]);
  }
  return VT_OK;
}

static vt_status read_position(obj_file *obj, const char *at) {
  double v[7];
  float file[3], *to;
  int count = vt_scan_numbers(at, 7, v);
  if ((count != 3 && count != 4 && count != 6 && count != 7) || !take_floats(v, 3, file))
    return vt_fail_line(&obj->text, at, "a vertex is not 3, 4, 6 or 7 finite numbers; correct it");
  if (!(to = add_triple(obj->ctx, &obj->lists[POSITION]))) return VT_OUT_OF_MEMORY;
  vt_world_from_file(file, to);
  return add_colour(obj, count >= 6 ? v + 3 : NULL);
}

static vt_status read_normal(obj_file *obj, const char *at) {
  double v[3];
  float file[3], *to;
  if (vt_scan_numbers(at, 3, v) != 3 || !take_floats(v, 3, file))
    return vt_fail_line(&obj->text, at, "a normal is not 3 finite numbers; correct it");
  if (!(to = add_triple(obj->ctx, &obj->lists[NORMAL]))) return VT_OUT_OF_MEMORY;
  vt_make_unit(file);
  vt_world_from_file(file, to);
  return VT_OK;
}

static vt_status read_texture_point(obj_file *obj, const char *at) {
  double v[3];
  float *to;
  int count = vt_scan_numbers(at, 3, v);
  if (count == 1) v[1] = 0;
  if (count < 1 || !(to = add_triple(obj->ctx, &obj->lists[TEXTURE])))
    return count < 1 ? vt_fail_line(&obj->text, at, "a texture coordinate is not 1 to 3 numbers; correct it")
                     : VT_OUT_OF_MEMORY;
  return take_floats(v, 2, to) ? VT_OK : vt_fail_line(&obj->text, at, "a texture coordinate is too large; correct it");
}

static size_t trimmed_length(const char *at) {
  size_t length = 0;
  for (size_t i = 0; at[i] && at[i] != '\n'; i++)
    if (at[i] != ' ' && at[i] != '\t' && at[i] != '\v') length = i + 1;
  return length;
}

// One name with blanks in it, or several without.
static vt_status read_libraries(obj_file *obj, const char *at) {
  char *path;
  size_t length = trimmed_length(at);
  vt_status status = vt_find_beside(obj->ctx, obj->text.path, at, length, &path);
  bool whole = path != NULL;
  for (const char *end = at + length; !status && at < end; at = vt_skip_blanks(at + vt_word_length(at))) {
    if (!whole) status = vt_find_beside(obj->ctx, obj->text.path, at, vt_word_length(at), &path);
    if (!status && !path)
      status = vt_fail_line(&obj->text, at, "there is no such material library; put it beside or take the line out");
    uint32_t *known = status ? NULL : vt_name_value(obj->ctx, &obj->library_names, path, strlen(path));
    if (!status && !known) status = VT_OUT_OF_MEMORY;
    if (!status && *known == VT_NO_VALUE) { // some files name theirs before every group
      *known = 0;
      status = vt_read_mtl(obj->ctx, path, &obj->library);
    }
    vt_free(obj->ctx, path);
    path = NULL;
    if (whole) break;
  }
  vt_free(obj->ctx, path);
  return status;
}

// Which list a line adds to, LIST_COUNT if none; *rest is what stands behind its word.
static int list_of(const char *at, const char **rest) {
  if (at[0] != 'v') return LIST_COUNT;
  if ((*rest = vt_skip_word(at, "v"))) return POSITION;
  if ((*rest = vt_skip_word(at, "vt"))) return TEXTURE;
  return (*rest = vt_skip_word(at, "vn")) ? NORMAL : LIST_COUNT;
}

static vt_status read_lists(obj_file *obj) {
  vt_status status = VT_OK;
  for (const char *at = vt_next_line(&obj->text, NULL); at && !status; at = vt_next_line(&obj->text, at)) {
    const char *rest;
    switch (list_of(at, &rest)) {
    case POSITION:
      status = read_position(obj, rest);
      break;
    case TEXTURE:
      status = read_texture_point(obj, rest);
      break;
    case NORMAL:
      status = read_normal(obj, rest);
      break;
    default:
      if (at[0] == 'm' && (rest = vt_skip_word(at, "mtllib"))) status = read_libraries(obj, rest);
    }
  }
  for (int i = 0; i < LIST_COUNT && !status; i++)
    if (obj->lists[i].count >= UINT32_MAX / 2)
      status = vt_fail(obj->ctx, VT_BAD_INPUT, "%s: more than 2^31 vertices; reduce the model", obj->text.path);
  return status;
}

// ---- second way: faces

static vt_status make_material(obj_file *obj) {
  vt_context *ctx = obj->ctx;
  vt_mesh *mesh = obj->mesh;
  const char *name = obj->material_name;
  size_t length = obj->material_name_length;
  uint32_t *value = vt_name_value(ctx, &obj->material_names, name, length);
  if (!value) return VT_OUT_OF_MEMORY;
  if (*value != VT_NO_VALUE) {
    obj->material = (int)*value;
    return VT_OK;
  }
  if (mesh->material_count == UINT16_MAX) return vt_fail_line(&obj->text, name, "over 65535 materials; join some");
  if ((size_t)mesh->material_count == obj->material_capacity) {
    size_t capacity = obj->material_capacity ? 2 * obj->material_capacity : 16;
    vt_material *materials = vt_realloc(ctx, mesh->materials, capacity, sizeof *materials);
    if (materials) mesh->materials = materials;
    vt_sides *sides = materials ? vt_realloc(ctx, obj->sides, capacity, sizeof *sides) : NULL;
    if (!sides) return VT_OUT_OF_MEMORY;
    obj->sides = sides;
    obj->material_capacity = capacity;
  }
  *value = (uint32_t)mesh->material_count;
  obj->material = mesh->material_count;
  vt_material *material = &mesh->materials[mesh->material_count];
  uint32_t entry = vt_find_name(&obj->library.names, name, length);
  if (entry != VT_NO_VALUE) {
    obj->sides[obj->material] = obj->library.entries[entry].sides;
    vt_status status = vt_load_mtl_entry(ctx, &obj->library.entries[entry], material);
    if (!status) mesh->material_count++;
    return status;
  }
  vt_fill_plain_material(material, false);
  for (int c = 0; c < 3 && !obj->colour_count; c++) material->albedo[c] = 0.8f; // what other programs show
  if (length >= sizeof material->name) length = sizeof material->name - 1;
  memset(material->name, 0, sizeof material->name);
  memcpy(material->name, name, length);
  obj->sides[obj->material] = VT_SIDES_UNSAID;
  mesh->material_count++;
  return VT_OK;
}

static const char *scan_index(obj_file *obj, const char *at, int list, uint32_t *index) {
  uint64_t n = 0, count = obj->lists[list].count, seen = obj->seen[list];
  bool from_end = *at == '-';
  at += from_end;
  if (*at < '0' || *at > '9') return NULL;
  for (; *at >= '0' && *at <= '9'; at++)
    if (n <= UINT32_MAX) n = n * 10 + (uint64_t)(*at - '0');
  if (n == 0 || n > (from_end ? seen : count)) return NULL;
  *index = (uint32_t)(from_end ? seen - n : n - 1);
  return at;
}

static const char *scan_corner(obj_file *obj, const char *at, corner *out) {
  for (int i = 0; i < LIST_COUNT; i++) out->index[i] = NOT_GIVEN;
  for (int list = 0;; at++) {
    if (list == POSITION || (*at != '/' && *at != ' ' && *at != '\t' && *at != '\v' && !vt_at_line_end(at)))
      at = scan_index(obj, at, list, &out->index[list]);
    if (!at || *at != '/') break;
    if (++list == LIST_COUNT) return NULL;
  }
  return at && (*at == ' ' || *at == '\t' || *at == '\v' || vt_at_line_end(at)) ? at : NULL;
}

static bool grow_face(obj_file *obj) {
  size_t capacity = obj->corner_capacity ? 2 * obj->corner_capacity : 64;
  void *corners = vt_realloc(obj->ctx, obj->corners, capacity, sizeof *obj->corners);
  if (corners) obj->corners = corners;
  void *points = corners ? vt_realloc(obj->ctx, obj->points, capacity, sizeof *obj->points) : NULL;
  if (points) obj->points = points;
  void *order = points ? vt_realloc(obj->ctx, obj->order, capacity, sizeof *obj->order) : NULL;
  if (order) obj->order = order;
  void *triangles = order ? vt_realloc(obj->ctx, obj->triangles, capacity, sizeof *obj->triangles) : NULL;
  if (triangles) obj->triangles = triangles;
  if (triangles) obj->corner_capacity = capacity;
  return triangles != NULL;
}

static void take_colour(const obj_file *obj, uint32_t position, vt_vertex *to) {
  for (int k = 0; k < 3; k++) to->albedo[k] = 1;
  if (!obj->colour_count || obj->colours[position][0] < 0) return;
  const double *colour = obj->colours[position];
  double scale = obj->largest_colour > 1 ? 1.0 / 255 : 1;
  for (int k = 0; k < 3; k++) to->albedo[k] = (float)vt_linear_from_srgb(colour[k] * scale);
}

static vt_status find_vertex(obj_file *obj, const corner *c, uint32_t *out) {
  vt_mesh *mesh = obj->mesh;
  uint32_t *value = vt_key_value(obj->ctx, &obj->vertices, c->index[0], c->index[1], c->index[2]);
  if (!value) return VT_OUT_OF_MEMORY;
  if (*value == VT_NO_VALUE) {
    vt_vertex *v = &mesh->vertices[mesh->vertex_count];
    memset(v, 0, sizeof *v);
    memcpy(v->position, obj->lists[POSITION].items[c->index[POSITION]], sizeof v->position);
    if (c->index[NORMAL] != NOT_GIVEN) memcpy(v->normal, obj->lists[NORMAL].items[c->index[NORMAL]], sizeof v->normal);
    if (c->index[TEXTURE] != NOT_GIVEN) memcpy(v->uv, obj->lists[TEXTURE].items[c->index[TEXTURE]], sizeof v->uv);
    take_colour(obj, c->index[POSITION], v);
    *value = (uint32_t)mesh->vertex_count++;
  }
  *out = *value;
  return VT_OK;
}

static vt_status read_face(obj_file *obj, const char *at) {
  vt_mesh *mesh = obj->mesh;
  size_t count = 0;
  const char *line = at;
  while (!vt_at_line_end(at)) {
    if (count == obj->corner_capacity && !grow_face(obj)) return VT_OUT_OF_MEMORY;
    const char *rest = scan_corner(obj, at, &obj->corners[count++]);
    if (!rest) return vt_fail_line(&obj->text, at, "a face names a corner that is not there; correct its indices");
    at = vt_skip_blanks(rest);
  }
  if (count < 3 || count > UINT32_MAX / 4)
    return vt_fail_line(&obj->text, line, "a face has fewer than 3 corners; take it out");
  vt_status status = obj->material < 0 ? make_material(obj) : VT_OK;
  if (!status &&
      (mesh->vertex_count + count > mesh->vertex_capacity || mesh->triangle_count + count > mesh->triangle_capacity))
    status = vt_reserve_read(obj->ctx, obj->text.path, mesh, count, count);
  for (size_t i = 0; i < count && !status; i++) {
    const float *p = obj->lists[POSITION].items[obj->corners[i].index[POSITION]];
    obj->points[i] = vt_v3(p[0], p[1], p[2]);
    status = find_vertex(obj, &obj->corners[i], &obj->corners[i].index[0]);
  }
  if (status) return status;
  vt_cut_polygon(obj->points, (uint32_t)count, obj->order, obj->triangles);
  for (size_t i = 0; i + 2 < count; i++) {
    const uint32_t *t = obj->triangles[i];
    mesh->triangle_materials[mesh->triangle_count] = (uint16_t)obj->material;
    vt_add_triangle(mesh, obj->corners[t[0]].index[0], obj->corners[t[1]].index[0], obj->corners[t[2]].index[0]);
  }
  return VT_OK;
}

static vt_status read_faces(obj_file *obj) {
  vt_status status = VT_OK;
  obj->material_name = "default";
  obj->material_name_length = strlen("default");
  obj->material = -1;
  size_t lines = 0;
  for (const char *at = vt_next_line(&obj->text, NULL); at && !status; at = vt_next_line(&obj->text, at)) {
    const char *rest;
    int list = list_of(at, &rest);
    if (list < LIST_COUNT) {
      obj->seen[list]++;
    } else if (at[0] == 'f' && (rest = vt_skip_word(at, "f"))) {
      status = read_face(obj, rest);
    } else if (at[0] == 'u' && (rest = vt_skip_word(at, "usemtl")) && trimmed_length(rest)) {
      obj->material_name = rest;
      obj->material_name_length = trimmed_length(rest);
      obj->material = -1;
    }
    if (!status && ++lines % 65536 == 0 && vt_cancelled(obj->ctx)) status = VT_CANCELLED;
  }
  if (!status && !obj->mesh->triangle_count)
    status = vt_fail(obj->ctx, VT_BAD_INPUT, "%s: holds no faces; export it as a mesh of triangles", obj->text.path);
  return status;
}

vt_status vt_read_obj(vt_context *ctx, const char *path, vt_mesh *out) {
  obj_file obj = {.ctx = ctx, .mesh = out};
  vt_status status = vt_open_text(ctx, path, &obj.text);
  if (!status) status = read_lists(&obj);
  if (!status) status = read_faces(&obj);
  if (!status) status = vt_mend_mesh(ctx, out, obj.sides);
  for (int i = 0; i < LIST_COUNT; i++) vt_free(ctx, obj.lists[i].items);
  vt_free(ctx, obj.colours);
  vt_free(ctx, obj.corners);
  vt_free(ctx, obj.points);
  vt_free(ctx, obj.order);
  vt_free(ctx, obj.triangles);
  vt_free(ctx, obj.sides);
  vt_free(ctx, obj.material_names.slots);
  vt_free(ctx, obj.library_names.slots);
  vt_free(ctx, obj.vertices.slots);
  vt_free_mtl(ctx, &obj.library);
  if (obj.text.begin) vt_close_text(&obj.text);
  return status;
}
