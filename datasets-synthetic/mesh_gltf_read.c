// mesh_gltf_read.c - glTF 2.0 files: nodes, instances and primitives to one mesh
// SPDX-License-Identifier: BSD-3-Clause
//
// The nodes of the scene are a forest: each is reached once, or the file is refused, so that a cycle ends. A node's
// matrix is its ancestors' times its own (or translation * rotation * scale); EXT_mesh_gpu_instancing puts many more
// behind it, as generators of forests do for leaves. Positions go through the matrix A, normals through its cofactors
// (det A * A^-T) and the sign of det A, and a mirroring turns the triangles round.
//   Of each primitive only the vertices that its triangles use are taken, once for each instance: primitives often
//   share
// one array. What was taken is marked with the number of the instance, so that the marks need no clearing.
// Skins and morphs stay in their rest pose; cameras, lights and animations are passed over.
#include "datasets-synthetic/mesh_gltf.h"

#include <string.h>

typedef struct affine {
  double m[12];
} affine; // 3 rows of 4

typedef struct primitive {
  size_t mesh, index; // for messages
  vt_gltf_accessor positions, normals, uvs, colours, indices;
  size_t corner_count, triangle_count; // corners: indices, or positions where there are none
  int mode;                            // 4 triangles, 5 strip, 6 fan
  uint16_t material;
} primitive;

typedef struct scene_reader {
  vt_gltf gltf;
  vt_mesh *mesh;
  vt_sides *sides; // owned, as all below
  int *uv_sets;
  size_t file_materials, node_count;
  affine *matrices; // [node_count] world from node
  bool *reached;
  uint32_t *stack;
  size_t mark_count;
  uint32_t *marks, *taken; // [mark_count] of the positions of a primitive: instance that took it, and as which vertex
  uint32_t instance;
  bool posed;
} scene_reader;

// ---- matrices

static affine multiply(const affine *a, const affine *b) {
  affine out;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 4; c++) {
      double sum = c == 3 ? a->m[4 * r + 3] : 0;
      for (int k = 0; k < 3; k++) sum += a->m[4 * r + k] * b->m[4 * k + c];
      out.m[4 * r + c] = sum;
    }
  return out;
}

// t translation, q rotation as a quaternion x y z w, s scale
static affine compose(const double t[3], const double q[4], const double s[3]) {
  double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], f = n > 0 ? 2 / n : 0;
  double x = q[0], y = q[1], z = q[2], w = q[3];
  const double r[9] = {1 - f * (y * y + z * z), f * (x * y - z * w),     f * (x * z + y * w),
                       f * (x * y + z * w),     1 - f * (x * x + z * z), f * (y * z - x * w),
                       f * (x * z - y * w),     f * (y * z + x * w),     1 - f * (x * x + y * y)};
  affine out;
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) out.m[4 * i + k] = r[3 * i + k] * s[k];
    out.m[4 * i + 3] = t[i];
  }
  return out;
}

static bool read_matrix(const vt_json *node, affine *out) {
  double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
  const vt_json *matrix = vt_json_member(node, "matrix");
  if (matrix) {
    if (!vt_gltf_numbers(matrix, 16, m)) return false;
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 4; c++) out->m[4 * r + c] = m[4 * c + r];
    return true;
  }
  const vt_json *move = vt_json_member(node, "translation"), *turn = vt_json_member(node, "rotation"),
                *stretch = vt_json_member(node, "scale");
  if ((move && !vt_gltf_numbers(move, 3, t)) || (turn && !vt_gltf_numbers(turn, 4, q)) ||
      (stretch && !vt_gltf_numbers(stretch, 3, s)))
    return false;
  *out = compose(t, q, s);
  return true;
}

// det A * A^-T, and the sign of det A
static double cofactors(const affine *a, vt_mat3 *out) {
  vt_vec3 r[3], c[3];
  for (int i = 0; i < 3; i++) r[i] = vt_v3(a->m[4 * i], a->m[4 * i + 1], a->m[4 * i + 2]);
  for (int i = 0; i < 3; i++) c[i] = vt_cross(r[(i + 1) % 3], r[(i + 2) % 3]);
  double sign = vt_dot(r[0], c[0]) < 0 ? -1 : 1;
  for (int i = 0; i < 3; i++) {
    c[i] = vt_scale(c[i], sign);
    out->m[3 * i] = c[i].x, out->m[3 * i + 1] = c[i].y, out->m[3 * i + 2] = c[i].z;
  }
  return sign;
}

// ---- primitives

static vt_status fail_primitive(const scene_reader *s, const primitive *p, const char *why) {
  return vt_fail(s->gltf.ctx, VT_BAD_INPUT, "%s: meshes[%zu].primitives[%zu]: %s; export it again", s->gltf.path,
                 p->mesh, p->index, why);
}

// An accessor that the object names; out->count 0 if it names none. count: what it must have, 0: any
static vt_status open_named(scene_reader *s, const primitive *p, const vt_json *object, const char *key, size_t count,
                            vt_gltf_accessor *out) {
  size_t index;
  *out = (vt_gltf_accessor){0};
  int named = vt_gltf_whole(object, key, SIZE_MAX, &index);
  if (!named) return VT_OK;
  if (named < 0) return fail_primitive(s, p, "the number of an accessor is not valid");
  vt_status status = vt_gltf_open_accessor(&s->gltf, index, out);
  if (!status && count && out->count != count) status = fail_primitive(s, p, "its accessors have different counts");
  return status;
}

static vt_status open_accessors(scene_reader *s, const vt_json *json, primitive *p) {
  const vt_json *attributes = vt_json_member(json, "attributes");
  char uv_name[24];
  vt_status status = open_named(s, p, attributes, "POSITION", 0, &p->positions);
  if (status || !p->positions.count) return status; // nothing to draw
  snprintf(uv_name, sizeof uv_name, "TEXCOORD_%d", s->uv_sets[p->material]);
  status = open_named(s, p, attributes, "NORMAL", p->positions.count, &p->normals);
  if (!status) status = open_named(s, p, attributes, uv_name, p->positions.count, &p->uvs);
  if (!status) status = open_named(s, p, attributes, "COLOR_0", p->positions.count, &p->colours);
  if (!status) status = open_named(s, p, json, "indices", 0, &p->indices);
  if (status) return status;
  if (p->positions.components != 3 || (p->normals.count && p->normals.components != 3) ||
      (p->uvs.count && p->uvs.components != 2) || (p->colours.count && p->colours.components < 3))
    return fail_primitive(s, p, "an attribute has the wrong number of components");
  int type = p->indices.type;
  if (p->indices.count && (p->indices.components != 1 || (type != 5121 && type != 5123 && type != 5125)))
    return fail_primitive(s, p, "its indices are no unsigned integers");
  p->colours.normalised = true; // integers always are
  return VT_OK;
}

static vt_status open_primitive(scene_reader *s, const vt_json *json, primitive *p) {
  size_t material = s->file_materials, mode = 4;
  if (vt_gltf_whole(json, "material", s->file_materials, &material) < 0 || vt_gltf_whole(json, "mode", 7, &mode) < 0)
    return fail_primitive(s, p, "its material or mode is not valid");
  p->material = (uint16_t)material;
  p->mode = (int)mode;
  if (mode < 4) return VT_OK; // points and lines
  if (material == s->file_materials) s->mesh->material_count = (int)s->file_materials + 1;
  vt_status status = open_accessors(s, json, p);
  p->corner_count = p->indices.count ? p->indices.count : p->positions.count;
  if (!status && (p->corner_count >= UINT32_MAX / 2 || p->positions.count >= UINT32_MAX / 2))
    return fail_primitive(s, p, "it has more than 2^31 corners");
  if (!status && p->positions.count && p->corner_count >= 3)
    p->triangle_count = mode == 4 ? p->corner_count / 3 : p->corner_count - 2;
  if (status || p->positions.count <= s->mark_count) return status;
  uint32_t *marks = vt_realloc(s->gltf.ctx, s->marks, p->positions.count, sizeof *marks);
  if (marks) s->marks = marks;
  uint32_t *taken = marks ? vt_realloc(s->gltf.ctx, s->taken, p->positions.count, sizeof *taken) : NULL;
  if (!taken) return VT_OUT_OF_MEMORY;
  s->taken = taken;
  s->mark_count = p->positions.count;
  return VT_OK;
}

// ---- instances

static bool take_vertex(const primitive *p, const affine *a, const vt_mat3 *turn, size_t i, vt_vertex *out) {
  float v[3], normal[3] = {0, 0, 0}, file[3];
  *out = (vt_vertex){.albedo = {1, 1, 1}};
  vt_gltf_floats(&p->positions, i, 3, v);
  for (int r = 0; r < 3; r++) {
    file[r] = (float)(a->m[4 * r] * v[0] + a->m[4 * r + 1] * v[1] + a->m[4 * r + 2] * v[2] + a->m[4 * r + 3]);
    if (!isfinite(file[r])) return false;
  }
  vt_world_from_file(file, out->position);
  if (p->normals.count) {
    vt_gltf_floats(&p->normals, i, 3, normal);
    vt_vec3 n = vt_mul(turn, vt_v3(normal[0], normal[1], normal[2]));
    normal[0] = (float)n.x, normal[1] = (float)n.y, normal[2] = (float)n.z;
    if (!isfinite(normal[0]) || !isfinite(normal[1]) || !isfinite(normal[2])) return false;
    vt_make_unit(normal);
    vt_world_from_file(normal, out->normal);
  }
  if (p->uvs.count) vt_gltf_floats(&p->uvs, i, 2, out->uv);
  if (!isfinite(out->uv[0]) || !isfinite(out->uv[1])) return false;
  if (p->colours.count) vt_gltf_floats(&p->colours, i, 3, out->albedo);
  for (int c = 0; c < 3; c++) out->albedo[c] = out->albedo[c] >= 0 ? fminf(out->albedo[c], 1) : 0; // NaN is 0
  return true;
}

static vt_status find_corner(scene_reader *s, const primitive *p, const affine *a, const vt_mat3 *turn, size_t corner,
                             uint32_t *out) {
  size_t i = p->indices.count ? vt_gltf_integer(&p->indices, corner) : corner;
  if (i >= p->positions.count) return fail_primitive(s, p, "an index names a vertex that is not there");
  if (s->marks[i] != s->instance) {
    vt_mesh *mesh = s->mesh;
    if (!take_vertex(p, a, turn, i, &mesh->vertices[mesh->vertex_count]))
      return fail_primitive(s, p, "a vertex is not finite");
    s->marks[i] = s->instance;
    s->taken[i] = (uint32_t)mesh->vertex_count++;
  }
  *out = s->taken[i];
  return VT_OK;
}

static vt_status add_instance(scene_reader *s, const primitive *p, const affine *a) {
  vt_mesh *mesh = s->mesh;
  size_t vertices = p->positions.count < p->corner_count ? p->positions.count : p->corner_count;
  vt_status status = VT_OK;
  if (!p->triangle_count) return VT_OK;
  if (mesh->vertex_count + vertices > mesh->vertex_capacity ||
      mesh->triangle_count + p->triangle_count > mesh->triangle_capacity)
    status = vt_reserve_read(s->gltf.ctx, s->gltf.path, mesh, vertices, p->triangle_count);
  vt_mat3 turn;
  bool mirrored = cofactors(a, &turn) < 0;
  s->instance++; // fewer than triangles, so it cannot come round
  for (size_t t = 0; t < p->triangle_count && !status; t++) {
    size_t corners[3] = {t, t + 1, t + 2};
    if (p->mode == 4) corners[0] = 3 * t, corners[1] = 3 * t + 1, corners[2] = 3 * t + 2;
    if (p->mode == 5 && t % 2) corners[1] = t + 2, corners[2] = t + 1;
    if (p->mode == 6) corners[0] = 0, corners[1] = t + 1, corners[2] = t + 2;
    uint32_t v[3];
    for (int i = 0; i < 3 && !status; i++) status = find_corner(s, p, a, &turn, corners[i], &v[i]);
    if (status) break;
    mesh->triangle_materials[mesh->triangle_count] = p->material;
    vt_add_triangle(mesh, v[0], v[mirrored ? 2 : 1], v[mirrored ? 1 : 2]);
  }
  return !status && vt_cancelled(s->gltf.ctx) ? VT_CANCELLED : status;
}

// The instances of EXT_mesh_gpu_instancing, or the one that a node is.
static vt_status add_instances(scene_reader *s, const vt_json *node, const primitive *p, const affine *world) {
  const vt_json *extension = vt_json_member(vt_json_member(node, "extensions"), "EXT_mesh_gpu_instancing");
  const vt_json *attributes = vt_json_member(extension, "attributes");
  if (!attributes) return add_instance(s, p, world);
  vt_gltf_accessor moves, turns, stretches;
  vt_status status = open_named(s, p, attributes, "TRANSLATION", 0, &moves);
  if (!status) status = open_named(s, p, attributes, "ROTATION", moves.count, &turns);
  size_t count = status ? 0 : moves.count ? moves.count : turns.count;
  if (!status) status = open_named(s, p, attributes, "SCALE", count, &stretches);
  if (!status && !count) count = stretches.count;
  for (size_t i = 0; i < count && !status; i++) {
    float t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, z[3] = {1, 1, 1};
    if (moves.count) vt_gltf_floats(&moves, i, 3, t);
    if (turns.count) vt_gltf_floats(&turns, i, 4, q);
    if (stretches.count) vt_gltf_floats(&stretches, i, 3, z);
    affine own =
        compose((double[3]){t[0], t[1], t[2]}, (double[4]){q[0], q[1], q[2], q[3]}, (double[3]){z[0], z[1], z[2]});
    affine a = multiply(world, &own);
    status = add_instance(s, p, &a);
  }
  return status;
}

static vt_status add_node(scene_reader *s, size_t index) {
  const vt_json *node = vt_gltf_item(&s->gltf, "nodes", index);
  size_t mesh_index;
  int named = vt_gltf_whole(node, "mesh", SIZE_MAX, &mesh_index);
  if (!named) return VT_OK;
  const vt_json *mesh = named > 0 ? vt_gltf_item(&s->gltf, "meshes", mesh_index) : NULL;
  if (!mesh) return vt_fail_gltf(&s->gltf, "nodes", index, "its mesh is not there; export it again");
  s->posed |= vt_json_member(node, "skin") != NULL;
  const vt_json *primitives = vt_json_member(mesh, "primitives");
  vt_status status = VT_OK;
  for (size_t i = 0; i < vt_json_count(primitives) && !status; i++) {
    primitive p = {.mesh = mesh_index, .index = i};
    status = open_primitive(s, vt_json_item(primitives, i), &p);
    if (!status) status = add_instances(s, node, &p, &s->matrices[index]);
  }
  return status;
}

// ---- the forest of nodes

static vt_status reach(scene_reader *s, const vt_json *list, size_t i, size_t *top, size_t *out) {
  double number = vt_json_number(vt_json_item(list, i), -1);
  if (!(number >= 0 && number < (double)s->node_count) || floor(number) != number)
    return vt_fail(s->gltf.ctx, VT_BAD_INPUT, "%s: a node or the scene names a node that is not there; export it again",
                   s->gltf.path);
  *out = (size_t)number;
  if (s->reached[*out])
    return vt_fail_gltf(&s->gltf, "nodes", *out, "has two parents or is its own ancestor; export it again");
  s->reached[*out] = true;
  s->stack[(*top)++] = (uint32_t)*out;
  return VT_OK;
}

static vt_status push_roots(scene_reader *s, size_t *top) {
  const affine identity = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  size_t scene = 0, node = 0;
  if (vt_gltf_whole(s->gltf.json, "scene", SIZE_MAX, &scene) < 0) scene = SIZE_MAX;
  const vt_json *list = vt_json_member(vt_gltf_item(&s->gltf, "scenes", scene), "nodes");
  vt_status status = VT_OK;
  for (size_t i = vt_json_count(list); i > 0 && !status; i--) { // the first one comes off the stack first
    status = reach(s, list, i - 1, top, &node);
    if (!status) s->matrices[node] = identity;
  }
  return status;
}

static vt_status read_nodes(scene_reader *s) {
  size_t top = 0, child = 0;
  s->node_count = vt_json_count(vt_json_member(s->gltf.json, "nodes"));
  if (s->node_count >= UINT32_MAX)
    return vt_fail(s->gltf.ctx, VT_BAD_INPUT, "%s: too many nodes; join some", s->gltf.path);
  s->matrices = VT_NEW(s->gltf.ctx, affine, s->node_count);
  s->reached = VT_NEW(s->gltf.ctx, bool, s->node_count);
  s->stack = VT_NEW(s->gltf.ctx, uint32_t, s->node_count);
  if (!s->matrices || !s->reached || !s->stack) return VT_OUT_OF_MEMORY;
  vt_status status = push_roots(s, &top);
  while (top && !status) {
    size_t index = s->stack[--top];
    const vt_json *node = vt_gltf_item(&s->gltf, "nodes", index), *children = vt_json_member(node, "children");
    affine own;
    if (!read_matrix(node, &own))
      return vt_fail_gltf(&s->gltf, "nodes", index, "its matrix is not finite numbers; export it again");
    s->matrices[index] = multiply(&s->matrices[index], &own); // held its parent's
    for (size_t i = vt_json_count(children); i > 0 && !status; i--) {
      status = reach(s, children, i - 1, &top, &child);
      if (!status) s->matrices[child] = s->matrices[index];
    }
    if (!status) status = add_node(s, index);
  }
  return status;
}

static vt_status read_textures(scene_reader *s) {
  vt_mesh *mesh = s->mesh;
  bool *used = VT_NEW(s->gltf.ctx, bool, s->file_materials + 1);
  vt_status status = used ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t t = 0; used && t < mesh->triangle_count; t++) used[mesh->triangle_materials[t]] = true;
  for (size_t i = 0; i < s->file_materials && !status; i++)
    if (used[i]) status = vt_gltf_texture(&s->gltf, i, &mesh->materials[i]);
  vt_free(s->gltf.ctx, used);
  return status;
}

vt_status vt_read_gltf(vt_context *ctx, const char *path, vt_mesh *out) {
  scene_reader s = {.mesh = out};
  vt_status status = vt_open_gltf(ctx, path, &s.gltf);
  if (status) return status;
  status = vt_gltf_materials(&s.gltf, out, &s.sides, &s.uv_sets);
  s.file_materials = (size_t)out->material_count;
  if (!status) status = read_nodes(&s);
  if (!status && !out->triangle_count)
    status = vt_fail(ctx, VT_BAD_INPUT, "%s: its scene holds no triangles; export the tree with it", path);
  if (!status) status = read_textures(&s);
  if (!status) status = vt_mend_mesh(ctx, out, s.sides);
  if (!status && s.posed) vt_log(ctx, VT_LOG_NORMAL, "%s: skins are read in their rest pose", path);
  vt_free(ctx, s.sides);
  vt_free(ctx, s.uv_sets);
  vt_free(ctx, s.matrices);
  vt_free(ctx, s.reached);
  vt_free(ctx, s.stack);
  vt_free(ctx, s.marks);
  vt_free(ctx, s.taken);
  vt_close_gltf(&s.gltf);
  return status;
}
