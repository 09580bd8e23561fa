// composite.c - a picture of one level, composited front to back on the CPU
// SPDX-License-Identifier: BSD-3-Clause
//
// Every pixel's ray is walked through the cells [octree.h, vt_walk_ray]; what a cell shows is composited in front of
// what lies behind it [Porter & Duff 1984]: C += T c, T *= 1 - a, until T < 1e-4. What a cell shows comes from the
// billboard textures of the chosen views; octree.h ("compositing") defines it, render/draw_gl_shaders.h says the same
// in GLSL. With chord l in cell edges:
//   sum        rgba = sum_v w_v (a_v rgb_v, a_v),  a_v = 1 - (1 - alpha_v)^l
//   geometric  s_v = -ln(1 - alpha_v),  s = exp(sum_v w_v ln(s_v + f)) - f with f = 1e-4,
//              rgb = sum_v w_v s_v rgb_v / sum_v w_v s_v,  a = 1 - exp(-s l)
// The floor f keeps ln finite where one view is transparent; adding it before and taking it off afterwards leaves a
// single view, and a cell that is transparent in all views, exactly as they are. An alpha of 255 counts as 254.5,
// for else no chord, however short, would let light through.
//
// Everything is measured in cell edges from the root's centre, and a ray by its crossing X0 of the plane through that
// centre parallel to the picture plane: X = X0 + g d, where g is the depth of a cell's centre behind that plane and d
// the ray's direction with depth 1. So g is small and exact, and neither the place nor the unit of the world nor the
// distance of the eye costs digits. In view v the point lies at the homogeneous pixel A + g B, both computed once per
// pixel in double.

#include "octree/composite_field.h"

#include <string.h>

#define OPAQUE_ENOUGH 1e-4f // transmittance at which a ray ends
#define DEPTH_FLOOR 1e-4f
#define NEAREST 1e-6f    // smallest depth before a view's camera, in cell edges
#define BLOCK_EDGE 16    // pixels of a block of work
#define CELLS_BLOCK 4096 // cells of a block of work

typedef struct projector { // homogeneous pixel of a view = m X + b, X in cell edges from the root's centre
  double m[9], b[3];
} projector;

typedef struct billboard { // what a cell shows in one of the chosen views
  float left, top, texel_scale; // vt_tile_frame; texel_scale 0: no tile
  uint32_t texture;             // raw: tile; packed: colour codeword << 16 | alpha codeword
} billboard;

typedef struct picture {
  vt_context *context;
  const vt_tree *tree;
  const vt_level *level;
  const vt_tiles *tiles;
  const vt_camera *camera;
  int level_number, texel_edge, view_count; // view_count 0: flat
  bool packed, geometric, skip_outside;
  float least_transmittance; // at which a ray ends
  int view[VT_MAX_BLEND_VIEWS];
  float weight[VT_MAX_BLEND_VIEWS];
  projector projectors[VT_MAX_BLEND_VIEWS];
  vt_vec3 eye;                // from the root's centre, cell edges
  float *plane;               // [cell_count] depth of the cell's centre behind the root's centre, cell edges
  billboard *billboards;      // [cell_count][view_count]
  vt_segment *segments;       // [thread_count][segment_capacity]
  size_t segment_capacity;
  float alpha_of_byte[256];   // 0..254.5
  int blocks_across;
  vt_fimage *out;
} picture;

typedef struct pixel_ray { // of one pixel: homogeneous pixel in view v = a[v] + g b[v]
  float a[VT_MAX_BLEND_VIEWS][3], b[VT_MAX_BLEND_VIEWS][3];
} pixel_ray;

// ---- exp and ln, the same bits on every machine, unlike libm's; relative error below 3e-7

static inline float exp_negative(float x) { // x <= 0
  float y = x * 1.44269504f;
  if (!(y > -126)) return 0;
  int whole = (int)(y - 0.5f);
  float f = y - (float)whole; // -0.5..0.5
  float p = 1 + f * (0.693147181f + f * (0.240226507f + f * (0.0555041087f + f * (0.00961812911f +
            f * (0.00133335581f + f * 0.000154035304f)))));
  uint32_t bits = (uint32_t)(127 + whole) << 23;
  float power;
  memcpy(&power, &bits, sizeof power);
  return p * power;
}

static inline float natural_log(float x) { // x > 0, normal
  uint32_t bits;
  memcpy(&bits, &x, sizeof bits);
  uint32_t shifted = bits - 0x3f3504f3u; // sqrt(1/2): mantissa into sqrt(1/2)..sqrt(2)
  int exponent = (int32_t)shifted >> 23;
  bits = (shifted & 0x007fffffu) + 0x3f3504f3u;
  float m;
  memcpy(&m, &bits, sizeof m);
  float s = (m - 1) / (m + 1), q = s * s;
  float p = 1 + q * (0.333333333f + q * (0.2f + q * (0.142857143f + q * 0.111111111f)));
  return (float)exponent * 0.693147181f + 2 * s * p;
}

// ---- what one cell shows

typedef struct texel_square { // four neighbouring texels: offsets in texels, shares of the bilinear mean
  int offset[4];
  float share[4];
} texel_square;

// From texel units, where texel i is centred at i, clamped to the outer centres.
static inline float clamp_texel(float t, float last) {
  t = !(t > 0) ? 0 : t; // also where t is NaN
  return t < last ? t : last;
}

static inline texel_square find_texels(const billboard *board, const float a[3], const float b[3], float g, int n) {
  float z = a[2] + g * b[2], inverse = 1 / (z > NEAREST ? z : NEAREST), last = (float)(n - 1);
  float x = clamp_texel(((a[0] + g * b[0]) * inverse - board->left) * board->texel_scale - 0.5f, last);
  float y = clamp_texel(((a[1] + g * b[1]) * inverse - board->top) * board->texel_scale - 0.5f, last);
  int column = (int)x, row = (int)y;
  float u = x - (float)column, v = y - (float)row;
  int right = column + 1 < n, below = row + 1 < n ? n : 0, first = row * n + column;
  return (texel_square){{first, first + right, first + below, first + below + right},
                        {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}

// Straight RGBA of a billboard, 0..1; colour only where alpha > 0.
static inline void sample_billboard(const picture *p, const billboard *board, const texel_square *at, float rgba[4]) {
  const uint8_t *alpha, *colour;
  int stride, texels = p->texel_edge * p->texel_edge;
  if (p->packed) {
    alpha = p->tree->alpha_codebook.codewords + (size_t)(board->texture & 0xffff) * (size_t)texels;
    colour = p->tree->colour_codebook.codewords + (size_t)(board->texture >> 16) * (size_t)texels * 3;
    stride = 3;
  } else {
    colour = p->tiles->texels + (size_t)board->texture * (size_t)texels * 4;
    alpha = colour + 3;
    stride = 4;
  }
  int alpha_stride = p->packed ? 1 : 4;
  float sum = 0;
  for (int i = 0; i < 4; i++) sum += at->share[i] * p->alpha_of_byte[alpha[at->offset[i] * alpha_stride]];
  rgba[3] = sum * (1 / 255.0f);
  if (!(sum > 0)) return;
  float r = 0, g = 0, b = 0;
  for (int i = 0; i < 4; i++) {
    const uint8_t *texel = colour + at->offset[i] * stride;
    r += at->share[i] * texel[0];
    g += at->share[i] * texel[1];
    b += at->share[i] * texel[2];
  }
  rgba[0] = r * (1 / 255.0f);
  rgba[1] = g * (1 / 255.0f);
  rgba[2] = b * (1 / 255.0f);
}

static inline void show_sum(const picture *p, const pixel_ray *ray, const vt_segment *segment, float out[4]) {
  const billboard *boards = p->billboards + (size_t)segment->cell * (size_t)p->view_count;
  float g = p->plane[segment->cell], total = 0, rgba[4] = {0};
  out[0] = out[1] = out[2] = out[3] = 0;
  for (int v = 0; v < p->view_count; v++) {
    if (!(boards[v].texel_scale > 0)) continue;
    total += p->weight[v];
    texel_square at = find_texels(&boards[v], ray->a[v], ray->b[v], g, p->texel_edge);
    sample_billboard(p, &boards[v], &at, rgba);
    if (!(rgba[3] > 0)) continue;
    float share = p->weight[v] * (1 - exp_negative(segment->length * natural_log(1 - rgba[3])));
    for (int c = 0; c < 3; c++) out[c] += share * rgba[c];
    out[3] += share;
  }
  if (!(out[3] > 0)) return;
  for (int c = 0; c < 4; c++) out[c] /= total;
}

static inline void show_geometric(const picture *p, const pixel_ray *ray, const vt_segment *segment, float out[4]) {
  const billboard *boards = p->billboards + (size_t)segment->cell * (size_t)p->view_count;
  float g = p->plane[segment->cell], total = 0, logs = 0, shares = 0, rgba[4] = {0};
  out[0] = out[1] = out[2] = out[3] = 0;
  for (int v = 0; v < p->view_count; v++) {
    if (!(boards[v].texel_scale > 0)) continue;
    total += p->weight[v];
    texel_square at = find_texels(&boards[v], ray->a[v], ray->b[v], g, p->texel_edge);
    sample_billboard(p, &boards[v], &at, rgba);
    float depth = rgba[3] > 0 ? -natural_log(1 - rgba[3]) : 0, share = p->weight[v] * depth;
    logs += p->weight[v] * natural_log(depth + DEPTH_FLOOR);
    if (!(share > 0)) continue;
    for (int c = 0; c < 3; c++) out[c] += share * rgba[c];
    shares += share;
  }
  if (!(shares > 0)) return;
  float mean = logs / total; // ln of at most ln(510) = 6.2: exp_negative takes it with the factor 8 taken out
  float depth = 8 * exp_negative(mean - 2.07944154f) - DEPTH_FLOOR;
  out[3] = depth > 0 ? 1 - exp_negative(-depth * segment->length) : 0;
  for (int c = 0; c < 3; c++) out[c] *= out[3] / shares;
}

static inline void show_flat(const picture *p, const vt_segment *segment, float out[4]) {
  const float *colour = p->level->colour + (size_t)segment->cell * 3;
  out[3] = 1 - exp_negative(-p->level->optical_depth[segment->cell] * segment->length);
  for (int c = 0; c < 3; c++) out[c] = out[3] * colour[c];
}

// ---- a pixel, a block

static void aim(const picture *p, double x, double y, pixel_ray *ray) {
  const vt_camera *camera = p->camera;
  vt_vec3 q = {(x - camera->cx) / camera->fx, (y - camera->cy) / camera->fy, 1}, forward = vt_camera_forward(camera);
  vt_vec3 d = vt_mul_transposed(&camera->rotation, q);
  d = vt_scale(d, 1 / vt_dot(forward, d));
  vt_vec3 x0 = vt_sub(p->eye, vt_scale(d, vt_dot(forward, p->eye)));
  for (int v = 0; v < p->view_count; v++)
    for (int i = 0; i < 3; i++) {
      const double *row = p->projectors[v].m + 3 * i;
      ray->a[v][i] = (float)(row[0] * x0.x + row[1] * x0.y + row[2] * x0.z + p->projectors[v].b[i]);
      ray->b[v][i] = (float)(row[0] * d.x + row[1] * d.y + row[2] * d.z);
    }
}

static void composite_pixel(const picture *p, int x, int y, vt_segment *segments, float out[4]) {
  vt_ray world = vt_camera_ray(p->camera, x + 0.5, y + 0.5);
  size_t count = vt_walk_ray(&p->tree->octree, p->level_number, &world, segments);
  if (!count) return;
  pixel_ray ray;
  aim(p, x + 0.5, y + 0.5, &ray);
  float transmittance = 1, sum[3] = {0}, shown[4];
  for (size_t i = 0; i < count && transmittance >= p->least_transmittance; i++) {
    if (!p->view_count) show_flat(p, &segments[i], shown);
    else if (p->geometric) show_geometric(p, &ray, &segments[i], shown);
    else show_sum(p, &ray, &segments[i], shown);
    for (int c = 0; c < 3; c++) sum[c] += transmittance * shown[c];
    transmittance *= 1 - shown[3];
  }
  for (int c = 0; c < 3; c++) out[c] = sum[c];
  out[3] = 1 - transmittance;
}

static void composite_blocks(void *user, size_t begin, size_t end, int worker) {
  const picture *p = user;
  vt_segment *segments = p->segments + (size_t)worker * p->segment_capacity;
  for (size_t block = begin; block < end; block++) {
    int left = (int)(block % (size_t)p->blocks_across) * BLOCK_EDGE;
    int top = (int)(block / (size_t)p->blocks_across) * BLOCK_EDGE;
    for (int y = top; y < top + BLOCK_EDGE && y < p->out->height; y++) {
      if (vt_cancelled(p->context)) return;
      for (int x = left; x < left + BLOCK_EDGE && x < p->out->width; x++)
        composite_pixel(p, x, y, segments, p->out->pixels + 4 * ((size_t)y * (size_t)p->out->width + (size_t)x));
    }
  }
}

// ---- a picture

typedef struct frustum { // a point X before the eye is in the picture where all normal . (X - eye) >= 0
  vt_vec3 normal[5]; // unit, pointing inwards: left, right, top, bottom, forward
} frustum;

static frustum make_frustum(const vt_camera *c) {
  const vt_vec3 inwards[5] = {{c->fx, 0, c->cx}, {-c->fx, 0, c->width - c->cx}, {0, c->fy, c->cy},
                              {0, -c->fy, c->height - c->cy}, {0, 0, 1}};
  frustum f;
  for (int i = 0; i < 5; i++) f.normal[i] = vt_normalise(vt_mul_transposed(&c->rotation, inwards[i]));
  return f;
}

// Whether the ball around a cell, at `centre` from the eye in cell edges, is beyond one of the planes.
static inline bool is_outside(const frustum *f, vt_vec3 centre) {
  for (int i = 0; i < 5; i++)
    if (vt_dot(f->normal[i], centre) < -0.8661) return true; // sqrt(3) / 2
  return false;
}

static void place_cells(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const picture *p = user;
  const vt_level *level = p->level;
  const vt_tree *tree = p->tree;
  vt_vec3 forward = vt_camera_forward(p->camera);
  frustum picture_frustum = make_frustum(p->camera);
  double half = 0.5 * level->axis_cells - 0.5;
  for (size_t i = begin; i < end; i++) {
    vt_vec3 at = {level->x[i] - half, level->y[i] - half, level->z[i] - half};
    if (p->skip_outside && is_outside(&picture_frustum, vt_sub(at, p->eye))) continue; // no ray will ask for it
    p->plane[i] = (float)vt_dot(forward, at);
    vt_vec3 centre = vt_cell_centre(&tree->octree, p->level_number, (uint32_t)i);
    for (int v = 0; v < p->view_count; v++) {
      uint32_t tile = p->tiles->tile_of[(size_t)p->view[v] * level->cell_count + i];
      if (tile == VT_NO_TILE) continue;
      VT_VALIDATE(tile < p->tiles->tile_count);
      vt_tile_frame frame = vt_frame_of_tile(tree, p->level_number, p->view[v], centre);
      p->billboards[i * (size_t)p->view_count + (size_t)v] = (billboard){
          frame.left, frame.top, frame.texel_scale,
          p->packed ? (uint32_t)p->tiles->colour_code[tile] << 16 | p->tiles->alpha_code[tile] : tile};
    }
  }
}

// K (R (centre + edge X) + t) / edge
static projector make_projector(const vt_camera *camera, vt_vec3 root_centre, double edge) {
  vt_vec3 c = vt_scale(vt_to_camera(camera, root_centre), 1 / edge);
  const double *r = camera->rotation.m;
  projector out = {.b = {camera->fx * c.x + camera->cx * c.z, camera->fy * c.y + camera->cy * c.z, c.z}};
  for (int i = 0; i < 3; i++) {
    out.m[i] = camera->fx * r[i] + camera->cx * r[6 + i];
    out.m[3 + i] = camera->fy * r[3 + i] + camera->cy * r[6 + i];
    out.m[6 + i] = r[6 + i];
  }
  return out;
}

static void prepare(picture *p, const vt_view_weights *weights) {
  const vt_octree *octree = &p->tree->octree;
  double edge = vt_cell_edge(octree, p->level_number), half = 0.5 * octree->edge;
  vt_vec3 centre = vt_add(octree->origin, vt_v3(half, half, half));
  p->eye = vt_scale(vt_sub(vt_camera_centre(p->camera), centre), 1 / edge);
  for (int v = 0; v < p->view_count; v++) {
    VT_ASSERT(weights->view[v] >= 0 && weights->view[v] < p->tiles->view_count && weights->weight[v] > 0);
    p->view[v] = weights->view[v];
    p->weight[v] = weights->weight[v];
    p->projectors[v] = make_projector(&p->tree->cameras[p->view[v]], centre, edge);
  }
  for (int i = 0; i < 256; i++) p->alpha_of_byte[i] = i < 255 ? (float)i : 254.5f;
}

vt_status vt_composite(vt_context *context, const vt_tree *tree, int level, const vt_view_weights *weights,
                       vt_blend blend, bool flat, const vt_camera *camera, vt_fimage *out) {
  return vt_composite_skipping(context, tree, level, weights, blend, flat, VT_SKIP_ALL, camera, out);
}

vt_status vt_composite_skipping(vt_context *context, const vt_tree *tree, int level, const vt_view_weights *weights,
                                vt_blend blend, bool flat, unsigned skips, const vt_camera *camera, vt_fimage *out) {
  VT_ASSERT(level >= 0 && level < tree->octree.level_count && (flat || weights));
  VT_ASSERT(flat || (weights->count >= 0 && weights->count <= VT_MAX_BLEND_VIEWS));
  *out = (vt_fimage){0};
  vt_status status = vt_make_fimage(context, camera->width, camera->height, 4, out);
  if (status) return status;
  float least_transmittance = skips & VT_SKIP_HIDDEN ? OPAQUE_ENOUGH : 0;
  bool textured = tree->view_textures[level].view_count > 0;
  if (flat ? tree->octree.levels[level].corner_count > 0 : textured) {
    if (tree->octree.levels[level].cell_count && (flat || weights->count))
      status = vt_composite_field(context, tree, level, flat ? NULL : weights, least_transmittance, camera, out);
    if (status) vt_free_fimage(context, out);
    return status;
  }
  picture p = {.context = context, .tree = tree, .level = &tree->octree.levels[level], .tiles = &tree->tiles[level],
               .camera = camera, .level_number = level, .texel_edge = tree->texel_edge,
               .packed = vt_is_packed(tree), .geometric = blend == VT_BLEND_GEOMETRIC,
               .skip_outside = (skips & VT_SKIP_OUTSIDE) != 0,
               .least_transmittance = least_transmittance, .out = out};
  p.view_count = flat || !p.tiles->view_count ? 0 : weights->count;
  if ((!flat && !p.view_count) || !p.level->cell_count) return VT_OK; // nothing to show
  prepare(&p, weights);
  p.segment_capacity = vt_max_segments(p.level);
  size_t cells = p.level->cell_count;
  p.plane = VT_NEW(context, float, cells);
  p.billboards = VT_NEW(context, billboard, cells * (size_t)p.view_count);
  p.segments = VT_NEW(context, vt_segment, p.segment_capacity * (size_t)vt_thread_count(context));
  status = VT_OUT_OF_MEMORY;
  if (!p.plane || !p.billboards || !p.segments) goto done;
  if (p.view_count && (status = vt_parallel(context, cells, CELLS_BLOCK, place_cells, &p)) != VT_OK) goto done;
  p.blocks_across = (out->width + BLOCK_EDGE - 1) / BLOCK_EDGE;
  size_t blocks = (size_t)p.blocks_across * (size_t)((out->height + BLOCK_EDGE - 1) / BLOCK_EDGE);
  status = vt_parallel(context, blocks, 1, composite_blocks, &p);
done:
  vt_free(context, p.plane);
  vt_free(context, p.billboards);
  vt_free(context, p.segments);
  if (status) vt_free_fimage(context, out);
  return status;
}
