// strays.c - what a matte shows and the other photographs do not
// SPDX-License-Identifier: BSD-3-Clause
//
// A plain backdrop is seldom plain: cables, rails, a tray, the edge of the cloth differ from it as the plant does, and one
// photograph alone cannot tell them from it. Where things stand tells: a point of the tree is tree in every photograph that
// has it in its frame, before whatever it stands; a rail is so in those only where something else hides in the backdrop's
// place. So, space carving with room for error [Kutulakos, Seitz, "A theory of shape by space carving", IJCV 2000]:
//
// 1. An octree over the region that the cameras look at (clutter_region.c). A cell misses a photograph that has its footprint
//    in the frame and no matte anywhere in it. Footprints of children lie in their parents', so a cell that misses too many is
//    empty with all that is in it, and only the surroundings of the tree are ever split; one that all mattes fill is not split.
// 2. A cell is tree for a photograph if at most MISSES of the others miss it and enough of them have it in the frame.
// 3. What lies in no cell's footprint is a stray and goes; a part of which most goes, goes as a whole.
//
// Nothing is thinned: a cell needs no more than a touch of matte in its footprint, so that a stem a pixel wide is kept as long
// as most mattes have it. A matte is judged by the others' and never by itself or by what is reconstructed, and all are judged
// together before some are held out. What goes wrong: what stands still beside the tree in all photographs stays, and stubs of
// a cable where it meets the tree; from a narrow arc little is found, since depth is not known; where mattes and cameras
// disagree altogether nothing is touched, and said.

#include "capture/strays.h"
#include "capture/clutter.h"
#include "capture/spread.h"

#include <math.h>
#include <string.h>

enum { BLOCKS = 640, ROOTS = 16, DEEPEST = 5, VOTERS = 64, LEAST_VIEWS = 8 }; // BLOCKS, ROOTS: along the longer side; DEEPEST: splits
#define ROOM 1.5      // the cube's half edge over the region's radius
#define MISSES 0.2    // share of the photographs that may miss a cell of the tree
#define SIGHTS 0.33   // share that must have it in the frame,
#define FEW_SIGHTS 0.26 // and where it hangs on what so many have
#define LEAF 1.5      // blocks that the smallest cell is wide
#define TOUCH 32      // alpha from which a block shows something
#define MOST 0.5      // share of a part, from which it goes as a whole
#define MOST_ALL 0.25 // share of all mattes from which they rather disagree with the cameras

enum { NONE, FEW, ENOUGH };

typedef struct eye {
  vt_camera camera; // whose pixels are blocks
  int width, height, block;
  uint32_t *sums;   // [height + 1][width + 1] blocks that show something, over the rectangle from the corner; NULL: no voter
  uint8_t *shows;   // [height][width]
  uint8_t *tree;    // [height][width] the others show the tree there: ENOUGH of them, or FEW
} eye;

typedef struct cell {
  float centre[3], half; // world units
  uint8_t missed, framed; // by voters
} cell;

typedef struct cells {
  cell *items;
  size_t count, capacity;
} cells;

typedef struct work {
  vt_context *context;
  vt_views *views;
  eye *eyes;             // [views->count]
  int *voters, voter_count;
  vt_vec3 focus;
  double half;           // of the cube's edge
  int depth;             // splits below the roots
  cells found[ROOTS * ROOTS * ROOTS];
  vt_status *status;     // [views->count], or of roots
  double *lost, *all;    // [views->count] alpha
} work;

// ---- mattes as blocks

static vt_status open_eye(work *w, int i, bool votes) {
  const vt_image *p = &w->views->items[i].picture;
  eye *e = &w->eyes[i];
  int longer = p->width > p->height ? p->width : p->height;
  e->block = (longer + BLOCKS - 1) / BLOCKS;
  e->width = (p->width + e->block - 1) / e->block, e->height = (p->height + e->block - 1) / e->block;
  e->camera = w->views->items[i].camera;
  e->camera.fx /= e->block, e->camera.fy /= e->block, e->camera.cx /= e->block, e->camera.cy /= e->block;
  size_t count = (size_t)e->width * (size_t)e->height, row = (size_t)e->width + 1;
  e->shows = VT_NEW(w->context, uint8_t, count);
  e->tree = VT_NEW(w->context, uint8_t, count);
  if (votes) e->sums = VT_NEW(w->context, uint32_t, row *((size_t)e->height + 1));
  if (!e->shows || !e->tree || (votes && !e->sums)) return VT_OUT_OF_MEMORY;
  for (int y = 0; y < p->height; y++)
    for (int x = 0; x < p->width; x++)
      if (p->pixels[4 * ((size_t)y * (size_t)p->width + (size_t)x) + 3] >= TOUCH)
        e->shows[(size_t)(y / e->block) * (size_t)e->width + (size_t)(x / e->block)] = 1;
  for (size_t y = 0; y < (size_t)e->height && votes; y++) {
    uint32_t sum = 0;
    for (size_t x = 0; x + 1 < row; x++) {
      sum += e->shows[y * (row - 1) + x];
      e->sums[(y + 1) * row + x + 1] = e->sums[y * row + x + 1] + sum;
    }
  }
  return VT_OK;
}

static void open_block(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) w->status[i] = open_eye(w, (int)i, w->eyes[i].block < 0);
}

typedef struct footprint {
  int x0, y0, x1, y1; // blocks, x1, y1 excluded; within the picture
  bool framed;        // all of it is
} footprint;

// The square around the projection of a ball; false behind the camera or outside of the picture.
static bool find_footprint(const eye *e, const float centre[3], double radius, footprint *out) {
  vt_vec3 p = vt_to_camera(&e->camera, vt_v3((double)centre[0], (double)centre[1], (double)centre[2]));
  if (!(p.z > radius)) return false;
  double x = e->camera.fx * p.x / p.z + e->camera.cx, y = e->camera.fy * p.y / p.z + e->camera.cy;
  double rx = e->camera.fx * radius / p.z, ry = e->camera.fy * radius / p.z;
  if (!(x + rx > 0 && y + ry > 0 && x - rx < e->width && y - ry < e->height)) return false;
  out->framed = x - rx >= 0 && y - ry >= 0 && x + rx <= e->width && y + ry <= e->height;
  out->x0 = (int)fmax(x - rx, 0), out->y0 = (int)fmax(y - ry, 0);
  out->x1 = (int)fmin(x + rx + 1, e->width), out->y1 = (int)fmin(y + ry + 1, e->height);
  return true;
}

static uint32_t sum_within(const eye *e, const footprint *f) {
  size_t row = (size_t)e->width + 1;
  const uint32_t *top = e->sums + (size_t)f->y0 * row, *bottom = e->sums + (size_t)f->y1 * row;
  return bottom[f->x1] - bottom[f->x0] - top[f->x1] + top[f->x0];
}

// Whether what the footprint covers is not to be looked at.
static bool is_ignored(const vt_view *view, const eye *e, const footprint *f) {
  if (!view->ignored.pixels) return false;
  int x = (f->x0 + f->x1) / 2 * e->block, y = (f->y0 + f->y1) / 2 * e->block;
  return view->ignored.pixels[(size_t)y * (size_t)view->ignored.width + (size_t)x] != 0;
}

// ---- cells of the tree

static double radius_of(double half, bool leaf) {
  return half * (leaf ? 1.2 : 1.7321); // of a leaf that is looked at from anywhere, nearly all; of others all
}

static vt_status add_cell(work *w, cells *to, const cell *c) {
  if (to->count == to->capacity) {
    size_t capacity = to->capacity ? 2 * to->capacity : 64;
    cell *items = vt_realloc(w->context, to->items, capacity, sizeof *items);
    if (!items) return VT_OUT_OF_MEMORY;
    to->items = items, to->capacity = capacity;
  }
  to->items[to->count++] = *c;
  return VT_OK;
}

static vt_status search_cell(work *w, cells *to, const float centre[3], double half, int depth) {
  bool leaf = depth == 0, full = true;
  int missed = 0, framed = 0, seen = 0, most = (int)(MISSES * w->voter_count);
  double radius = radius_of(half, leaf);
  for (int v = 0; v < w->voter_count; v++) {
    const eye *e = &w->eyes[w->voters[v]];
    footprint f;
    if (!find_footprint(e, centre, radius, &f) || is_ignored(&w->views->items[w->voters[v]], e, &f)) continue;
    uint32_t sum = sum_within(e, &f);
    seen++;
    framed += f.framed || sum > 0, missed += f.framed && sum == 0;
    full = full && f.framed && sum == (uint32_t)((f.x1 - f.x0) * (f.y1 - f.y0));
    if (missed > most) return VT_OK;
  }
  if (seen < FEW_SIGHTS * (w->voter_count - 1) || missed > MISSES * seen) return VT_OK; // no child is seen by more
  if (leaf || full) {
    cell c = {{centre[0], centre[1], centre[2]}, (float)half, (uint8_t)missed, (uint8_t)framed};
    return add_cell(w, to, &c);
  }
  vt_status status = VT_OK;
  for (int k = 0; k < 8 && !status; k++) {
    float child[3];
    for (int a = 0; a < 3; a++) child[a] = centre[a] + (float)(k >> a & 1 ? half / 2 : -half / 2);
    status = search_cell(w, to, child, half / 2, depth - 1);
  }
  return status;
}

static void search_roots(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    double half = w->half / ROOTS, at[3] = {w->focus.x, w->focus.y, w->focus.z};
    size_t place[3] = {i % ROOTS, i / ROOTS % ROOTS, i / ROOTS / ROOTS};
    float centre[3];
    for (int a = 0; a < 3; a++) centre[a] = (float)(at[a] - w->half + half * (double)(2 * place[a] + 1));
    w->status[i] = search_cell(w, &w->found[i], centre, half, w->depth);
  }
}

// Marks in a photograph what the others' cells cover.
static void look_at_cells(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    eye *e = &w->eyes[i];
    int others = w->voter_count - (e->sums != NULL);
    for (size_t r = 0; r < ROOTS * ROOTS * ROOTS; r++)
      for (size_t k = 0; k < w->found[r].count; k++) {
        const cell *c = &w->found[r].items[k];
        footprint f;
        if (!find_footprint(e, c->centre, radius_of((double)c->half, true), &f)) continue;
        int missed = c->missed, framed = c->framed;
        if (e->sums && (f.framed || sum_within(e, &f))) framed--, missed -= sum_within(e, &f) == 0;
        if (framed < FEW_SIGHTS * others || missed > MISSES * framed) continue;
        uint8_t sights = framed < SIGHTS * others ? FEW : ENOUGH;
        for (int y = f.y0; y < f.y1; y++)
          for (int x = f.x0; x < f.x1; x++) {
            uint8_t *tree = &e->tree[(size_t)y * (size_t)e->width + (size_t)x];
            if (*tree < sights) *tree = sights;
          }
      }
  }
}

// ---- parts of a matte

// A part of blocks that show something, by their eight neighbours, from `seed`; they become 2. Its blocks are in stack[0..].
static size_t flood(eye *e, size_t seed, uint32_t *stack) {
  size_t count = 0;
  e->shows[seed] = 2;
  stack[count++] = (uint32_t)seed;
  for (size_t next = 0; next < count; next++) {
    int x = (int)(stack[next] % (uint32_t)e->width), y = (int)(stack[next] / (uint32_t)e->width);
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < e->height; j++)
      for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < e->width; i++) {
        size_t p = (size_t)j * (size_t)e->width + (size_t)i;
        if (e->shows[p] == 1) e->shows[p] = 2, stack[count++] = (uint32_t)p;
      }
  }
  return count;
}

// `tree` becomes NONE in parts that ENOUGH do not show most of.
static vt_status drop_parts(work *w, eye *e) {
  size_t count = (size_t)e->width * (size_t)e->height;
  uint32_t *stack = VT_NEW(w->context, uint32_t, count);
  if (!stack) return VT_OUT_OF_MEMORY;
  for (size_t seed = 0; seed < count; seed++) {
    if (e->shows[seed] != 1) continue;
    size_t size = flood(e, seed, stack), stray = 0;
    for (size_t k = 0; k < size; k++) stray += e->tree[stack[k]] != ENOUGH;
    for (size_t k = 0; k < size && (double)stray > MOST * (double)size; k++) e->tree[stack[k]] = NONE;
  }
  vt_free(w->context, stack);
  return VT_OK;
}

static bool is_stray(const eye *e, int x, int y) {
  return !e->tree[(size_t)(y / e->block) * (size_t)e->width + (size_t)(x / e->block)];
}

static void judge_parts(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    const vt_image *p = &w->views->items[i].picture;
    w->status[i] = drop_parts(w, &w->eyes[i]);
    w->lost[i] = w->all[i] = 0;
    for (int y = 0; y < p->height; y++)
      for (int x = 0; x < p->width; x++) {
        double alpha = p->pixels[4 * ((size_t)y * (size_t)p->width + (size_t)x) + 3] / 255.0;
        w->all[i] += alpha, w->lost[i] += is_stray(&w->eyes[i], x, y) ? alpha : 0;
      }
  }
}

static vt_status clear_view(work *w, size_t i) {
  vt_image *p = &w->views->items[i].picture, rgb = {0}, filled = {0};
  size_t count = (size_t)p->width * (size_t)p->height;
  uint8_t *known = VT_NEW(w->context, uint8_t, count);
  vt_status status = known ? vt_make_image(w->context, p->width, p->height, 3, &rgb) : VT_OUT_OF_MEMORY;
  for (size_t k = 0; k < count && !status; k++) {
    memcpy(rgb.pixels + 3 * k, p->pixels + 4 * k, 3);
    known[k] = p->pixels[4 * k + 3] >= TOUCH && !is_stray(&w->eyes[i], (int)(k % (size_t)p->width), (int)(k / (size_t)p->width));
  }
  if (!status) status = vt_spread_colours(w->context, &rgb, known, &filled);
  for (size_t k = 0; k < count && !status; k++) {
    if (!is_stray(&w->eyes[i], (int)(k % (size_t)p->width), (int)(k / (size_t)p->width))) continue;
    memcpy(p->pixels + 4 * k, filled.pixels + 3 * k, 3);
    p->pixels[4 * k + 3] = 0;
  }
  vt_free(w->context, known);
  vt_free_image(w->context, &rgb);
  vt_free_image(w->context, &filled);
  return status;
}

static void clear_block(void *user, size_t begin, size_t end, int worker) {
  work *w = user;
  (void)worker;
  for (size_t i = begin; i < end; i++)
    if (w->lost[i] > 0) w->status[i] = clear_view(w, i);
}

// ---- all

// The region, as for clutter; false where it cannot be told.
static vt_status find_region(work *w, const vt_landmarks *landmarks, bool *found) {
  vt_clutter clutter = {.count = w->views->count, .photos = VT_NEW(w->context, vt_clutter_photo, (size_t)w->views->count)};
  if (!clutter.photos) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < clutter.count; i++) {
    const vt_camera *c = &w->views->items[i].camera;
    clutter.photos[i].lens = (vt_lens){.width = c->width, .height = c->height, .fx = c->fx, .fy = c->fy, .cx = c->cx, .cy = c->cy};
    clutter.photos[i].rotation = c->rotation, clutter.photos[i].translation = c->translation;
  }
  vt_status status = vt_find_clutter_region(w->context, landmarks, &clutter);
  *found = !status && clutter.radius > 0;
  if (status == VT_BAD_INPUT) vt_clear_error(w->context), status = VT_OK;
  w->focus = clutter.focus, w->half = ROOM * clutter.radius;
  vt_free_clutter(w->context, &clutter);
  return status;
}

// How often a root is split until a cell is about LEAF blocks wide where the tree stands.
static int choose_depth(const work *w) {
  double distance = 0, focal = 0;
  for (int v = 0; v < w->voter_count; v++) {
    const eye *e = &w->eyes[w->voters[v]];
    distance += vt_length(vt_to_camera(&e->camera, w->focus)) / w->voter_count, focal += e->camera.fx / w->voter_count;
  }
  int depth = 0;
  while (depth < DEEPEST && 2 * w->half / (ROOTS << depth) * focal / distance > LEAF) depth++;
  return depth;
}

static vt_status first_of(const vt_status *status, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (status[i]) return status[i];
  return VT_OK;
}

static vt_status run(work *w, vt_strays *out) {
  size_t count = (size_t)w->views->count, roots = ROOTS * ROOTS * ROOTS;
  for (int i = 0; i < w->views->count; i++) // evenly spread
    if (w->views->count <= VOTERS || (int64_t)i * VOTERS / w->views->count != (int64_t)(i + 1) * VOTERS / w->views->count)
      w->voters[w->voter_count++] = i, w->eyes[i].block = -1;
  vt_status status = vt_parallel(w->context, count, 1, open_block, w);
  if (!status) status = first_of(w->status, count);
  w->depth = choose_depth(w);
  if (!status) status = vt_parallel(w->context, roots, 8, search_roots, w);
  if (!status) status = first_of(w->status, roots);
  if (!status) status = vt_parallel(w->context, count, 1, look_at_cells, w);
  if (!status) status = vt_parallel(w->context, count, 1, judge_parts, w);
  if (!status) status = first_of(w->status, count);
  double lost = 0, all = 1e-9;
  for (size_t i = 0; i < count && !status; i++) {
    lost += w->lost[i], all += w->all[i];
    out->photographs += w->lost[i] > 0;
  }
  out->share = lost / all;
  out->refused = out->share > MOST_ALL;
  if (status || out->refused) return status;
  status = vt_parallel(w->context, count, 1, clear_block, w);
  return status ? status : first_of(w->status, count);
}

vt_status vt_clear_strays(vt_context *context, const vt_landmarks *landmarks, vt_views *views, vt_strays *out) {
  *out = (vt_strays){0};
  if (views->count < LEAST_VIEWS) return VT_OK;
  size_t count = (size_t)views->count, roots = ROOTS * ROOTS * ROOTS;
  work *w = VT_NEW(context, work, 1);
  if (!w) return VT_OUT_OF_MEMORY;
  w->context = context, w->views = views;
  w->eyes = VT_NEW(context, eye, count);
  w->voters = VT_NEW(context, int, count);
  w->status = VT_NEW(context, vt_status, count > roots ? count : roots);
  w->lost = VT_NEW(context, double, count);
  w->all = VT_NEW(context, double, count);
  vt_status status = w->eyes && w->voters && w->status && w->lost && w->all ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) status = find_region(w, landmarks, &out->tried);
  if (!status && out->tried) status = run(w, out);
  for (size_t i = 0; i < count && w->eyes; i++) {
    vt_free(context, w->eyes[i].sums);
    vt_free(context, w->eyes[i].shows);
    vt_free(context, w->eyes[i].tree);
  }
  for (size_t r = 0; r < roots; r++) vt_free(context, w->found[r].items);
  vt_free(context, w->eyes);
  vt_free(context, w->voters);
  vt_free(context, w->status);
  vt_free(context, w->lost);
  vt_free(context, w->all);
  vt_free(context, w);
  return status;
}
