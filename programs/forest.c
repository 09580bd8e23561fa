// forest.c - many trees in one picture, far to near
// SPDX-License-Identifier: BSD-3-Clause
//
// Trees stand upright, each within a cylinder of radius r_i around its axis p_i. Where the circles on the ground are apart,
// the order by power distance |e - p_i|^2 - r_i^2 of the eye's foot e, largest first, is exact: the points of equal power
// to two circles are a line between them, so their cylinders are parted by an upright plane, and no ray crosses it back
// [Edelsbrunner 1989, An acyclicity theorem for cell complexes in d dimensions]. Plain distance is not: a small tree may
// stand beside a large one, nearer at its rim and farther at its axis.
// A tree is drawn by its own renderer: the scene's camera is moved into the tree's world and cut to the rectangle on
// which all its cells fall; then its picture goes over what is there. The cylinder that keeps trees apart is that of the
// finest level and leaves a rest of haze outside: what stands out of it, or is a cell of a coarser level, which far away is
// some pixels wide, may be drawn on the wrong side of a neighbour. Far trees cost a walk over all cells of their level,
// each: honest and simple, and what a draw list of all trees must beat.

#include "programs/forest.h"

#include "base/rng.h"
#include "programs/orbit.h"

#define RINGS 256
#define HAZE 0.005 // share of the opacity that may stand out
#define SMALLEST_SCALE 0.8
#define LARGEST_SCALE 1.2

// ---- species

static void measure_species(vt_species *s) {
  vt_orbit orbit = vt_find_orbit(s->tree);
  const vt_octree *octree = &s->tree->octree;
  int finest = octree->level_count - 1;
  double half = 0.8661 * vt_cell_edge(octree, finest), low = INFINITY, high = -INFINITY; // half: sqrt(3) / 2 edges
  s->up = orbit.up, s->aside = orbit.aside, s->back = vt_scale(orbit.ahead, -1);
  const vt_level *level = &octree->levels[finest];
  double opacity[RINGS] = {0}, all = 0,
         widest = 0.5 * sqrt(3) * octree->edge + vt_length(vt_sub(orbit.centre, octree->origin));
  for (uint32_t i = 0; i < level->cell_count; i++) {
    vt_vec3 way = vt_sub(vt_cell_centre(octree, finest, i), orbit.centre);
    double z = vt_dot(way, s->up), r = vt_length(vt_sub(way, vt_scale(s->up, z))) + half;
    low = fmin(low, z - half), high = fmax(high, z + half);
    s->reach = fmax(s->reach, r);
    double share = -expm1(-(double)level->optical_depth[i]);
    int ring = (int)(RINGS * r / widest);
    opacity[ring < RINGS ? ring : RINGS - 1] += share;
    all += share;
  }
  int ring = RINGS;
  for (double outside = 0; ring > 1 && outside + opacity[ring - 1] <= HAZE * all; ring--) outside += opacity[ring - 1];
  s->radius = fmin(s->reach, widest * ring / RINGS);
  s->height = high > low ? high - low : 1;
  s->foot = vt_add(orbit.centre, vt_scale(s->up, high > low ? low : 0));
}

vt_status vt_begin_forest(vt_context *context, const vt_tree *const *trees, int count, vt_backend backend, vt_forest *out) {
  VT_ASSERT(count >= 1);
  *out = (vt_forest){.species = VT_NEW(context, vt_species, (size_t)count)};
  vt_status status = out->species ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < count && !status; i++) {
    out->species[i].tree = trees[i];
    measure_species(&out->species[i]);
    status = vt_create_renderer(context, trees[i], backend, &out->species[i].renderer);
    out->species_count = i + 1;
  }
  if (status) vt_free_forest(context, out);
  return status;
}

void vt_free_forest(vt_context *context, vt_forest *forest) {
  for (int i = 0; i < forest->species_count; i++) vt_destroy_renderer(context, forest->species[i].renderer);
  vt_free(context, forest->species);
  vt_free(context, forest->instances);
  *forest = (vt_forest){0};
}

// ---- planting

// Distance of two rows, so that the largest trees do not touch: their heights are brought to 1 before.
static double row_distance(const vt_forest *forest) {
  double widest = 0;
  for (int i = 0; i < forest->species_count; i++)
    widest = fmax(widest, forest->species[i].radius / forest->species[i].height);
  return 2.1 * LARGEST_SCALE * widest;
}

static int row_length(const vt_forest *forest) {
  int side = 1;
  while (side * side < forest->instance_count) side++;
  return side;
}

double vt_forest_reach(const vt_forest *forest) { return 0.5 * row_distance(forest) * row_length(forest); }

vt_status vt_plant_forest(vt_context *context, vt_forest *forest, int count, uint64_t seed) {
  VT_ASSERT(count >= 1);
  vt_free(context, forest->instances);
  forest->instances = VT_NEW(context, vt_instance, (size_t)count);
  forest->instance_count = forest->instances ? count : 0;
  if (!forest->instances) return VT_OUT_OF_MEMORY;
  double step = row_distance(forest);
  int side = row_length(forest);
  for (int i = 0; i < count; i++) {
    vt_rng rng = vt_seed_rng(seed, (uint64_t)i);
    const vt_species *s = &forest->species[i % forest->species_count];
    double scale = SMALLEST_SCALE + (LARGEST_SCALE - SMALLEST_SCALE) * vt_random_unit(&rng);
    double room = fmax(0, 0.5 * step - s->radius / s->height * scale); // the circle stays within its square
    forest->instances[i] = (vt_instance){.species = i % forest->species_count,
                                         .x = step * (i % side - 0.5 * (side - 1)) + room * (2 * vt_random_unit(&rng) - 1),
                                         .y = step * (i / side - 0.5 * (side - 1)) + room * (2 * vt_random_unit(&rng) - 1),
                                         .angle = 2 * VT_PI * vt_random_unit(&rng),
                                         .scale = scale / s->height};
  }
  return VT_OK;
}

// ---- one instance

typedef struct rectangle {
  int left, top, right, bottom;
} rectangle; // pixels; empty: nothing to draw

// Where all cells of the instance fall; the whole picture where it reaches behind the eye.
static rectangle find_rectangle(const vt_camera *camera, const vt_species *s, const vt_instance *instance) {
  double r = s->reach * instance->scale, h = s->height * instance->scale, low[2] = {INFINITY, INFINITY},
         high[2] = {-INFINITY, -INFINITY};
  int behind = 0;
  for (int corner = 0; corner < 8; corner++) {
    vt_vec3 p = {instance->x + (corner & 1 ? r : -r), instance->y + (corner & 2 ? r : -r), corner & 4 ? h : 0};
    vt_vec3 q = vt_to_camera(camera, p);
    if (q.z <= 1e-3 * h) {
      behind++;
      continue;
    }
    double pixel[2] = {camera->fx * q.x / q.z + camera->cx, camera->fy * q.y / q.z + camera->cy};
    for (int a = 0; a < 2; a++) low[a] = fmin(low[a], pixel[a]), high[a] = fmax(high[a], pixel[a]);
  }
  if (behind == 8) return (rectangle){0, 0, 0, 0};
  if (behind) return (rectangle){0, 0, camera->width, camera->height};
  return (rectangle){(int)fmax(0, fmin(camera->width, floor(low[0]))), (int)fmax(0, fmin(camera->height, floor(low[1]))),
                     (int)fmin(camera->width, fmax(0, ceil(high[0]))), (int)fmin(camera->height, fmax(0, ceil(high[1])))};
}

// The scene's camera in the tree's own world: X_scene = p + scale B (X_tree - foot), B's rows the scene's axes there.
static vt_camera move_camera(const vt_camera *camera, const vt_species *s, const vt_instance *instance,
                             const rectangle *cut) {
  double c = cos(instance->angle), sn = sin(instance->angle);
  vt_vec3 x = vt_sub(vt_scale(s->aside, c), vt_scale(s->back, sn)),
          y = vt_add(vt_scale(s->aside, sn), vt_scale(s->back, c));
  const double b[9] = {x.x, x.y, x.z, y.x, y.y, y.z, s->up.x, s->up.y, s->up.z};
  vt_camera out = *camera;
  for (int row = 0; row < 3; row++)
    for (int column = 0; column < 3; column++) {
      double sum = 0;
      for (int k = 0; k < 3; k++) sum += camera->rotation.m[3 * row + k] * b[3 * k + column];
      out.rotation.m[3 * row + column] = sum;
    }
  vt_vec3 place = vt_to_camera(camera, vt_v3(instance->x, instance->y, 0));
  out.translation = vt_sub(vt_scale(place, 1 / instance->scale), vt_mul(&out.rotation, s->foot));
  out.cx -= cut->left, out.cy -= cut->top;
  out.width = cut->right - cut->left, out.height = cut->bottom - cut->top;
  return out;
}

static void put_over(vt_fimage *scene, const vt_fimage *tree, const rectangle *at) {
  for (int y = 0; y < tree->height; y++) {
    float *to = scene->pixels + 4 * ((size_t)(at->top + y) * (size_t)scene->width + (size_t)at->left);
    const float *from = tree->pixels + 4 * (size_t)y * (size_t)tree->width;
    for (int x = 0; x < tree->width; x++, to += 4, from += 4)
      for (int c = 0; c < 4; c++) to[c] = from[c] + (1 - from[3]) * to[c];
  }
}

// ---- the scene

typedef struct rank {
  double power;
  int instance;
} rank;

static int farther_first(const void *a, const void *b) {
  const rank *p = a, *q = b;
  if (p->power != q->power) return p->power < q->power ? 1 : -1;
  return p->instance - q->instance;
}

static void sort_instances(const vt_forest *forest, vt_vec3 eye, rank *order) {
  for (int i = 0; i < forest->instance_count; i++) {
    const vt_instance *instance = &forest->instances[i];
    double r = forest->species[instance->species].radius * instance->scale, dx = eye.x - instance->x,
           dy = eye.y - instance->y;
    order[i] = (rank){dx * dx + dy * dy - r * r, i};
  }
  qsort(order, (size_t)forest->instance_count, sizeof *order, farther_first);
}

static vt_status draw_instance(vt_context *context, const vt_forest *forest, const vt_render_desc *desc,
                               const vt_camera *camera, int number, vt_fimage *scene, vt_forest_report *report) {
  const vt_instance *instance = &forest->instances[number];
  const vt_species *s = &forest->species[instance->species];
  rectangle cut = find_rectangle(camera, s, instance);
  if (cut.right <= cut.left || cut.bottom <= cut.top) {
    report->outside++;
    return VT_OK;
  }
  vt_camera own = move_camera(camera, s, instance, &cut);
  vt_fimage picture;
  vt_render_report drawn;
  vt_status status = vt_render(context, s->renderer, desc, &own, &picture, &drawn);
  if (status) return status;
  put_over(scene, &picture, &cut);
  vt_free_fimage(context, &picture);
  report->drawn++;
  report->billboards += drawn.billboards;
  report->pixels += (uint64_t)own.width * (uint64_t)own.height;
  return VT_OK;
}

vt_status vt_draw_forest(vt_context *context, const vt_forest *forest, const vt_render_desc *desc, const vt_camera *camera,
                         vt_fimage *out, vt_forest_report *or_null) {
  vt_forest_report report = {0};
  *out = (vt_fimage){0};
  rank *order = VT_NEW(context, rank, (size_t)forest->instance_count);
  vt_status status = order ? vt_check_camera(context, camera, "the scene's camera") : VT_OUT_OF_MEMORY;
  if (!status) status = vt_make_fimage(context, camera->width, camera->height, 4, out);
  if (!status) sort_instances(forest, vt_camera_centre(camera), order);
  for (int i = 0; i < forest->instance_count && !status; i++)
    status = draw_instance(context, forest, desc, camera, order[i].instance, out, &report);
  vt_free(context, order);
  if (status) vt_free_fimage(context, out);
  if (or_null) *or_null = report;
  return status;
}
