// truth_cells.c - mean extinction and leaf area of cells, from closed forms and from clipped triangles
// SPDX-License-Identifier: BSD-3-Clause
//
// Phantoms: the mean over a cell is the mean of its chords along an axis, and each chord has a closed form. 4 x 4
// chords along each of the three axes see a plate or a rim of any direction with at least one set of chords that
// crosses it, which 4^3 points do not: a plate thinner than their distance would be missed or counted whole.
//
// Meshes: a sheet of area A that may face anywhere stops A/2 on average over all directions (Cauchy: the mean
// projection of an element is half its area), so a cell of volume V holds the extinction A / 2V. The surface of a solid
// is met twice by a ray that goes through, entering and leaving, and what is met second stops nothing: its area counts
// half. Areas are exact: each triangle is cut by planes (Sutherland and Hodgman, "Reentrant polygon clipping", CACM
// 1974) into slabs along x, each piece into rows along y, each piece of these into cells along z, so that no piece is
// cut by a plane that it does not cross. A slab of cells is one item of work: its sums are in double, in the order of
// the triangles. What goes wrong without care: a triangle that lies in a plane between cells belongs to both if slabs
// are closed and to none if pieces without extent are dropped; it is given to the upper cell, as half-open cells want.

#include "datasets-synthetic/truth_cells.h"

// ---- phantoms

typedef struct chord_job {
  const vt_phantom *phantom;
  const vt_grid *grid;
  const uint16_t (*xyz)[3];
  float *extinction;
  vt_context *context;
} chord_job;

static double mean_of_chords(const vt_phantom *p, const double corner[3], double edge) {
  enum { SIDE = 4 };
  double sum = 0;
  for (int axis = 0; axis < 3; axis++)
    for (int k = 0; k < SIDE * SIDE; k++) {
      double at[3], along[3] = {axis == 0, axis == 1, axis == 2};
      at[axis] = corner[axis];
      at[(axis + 1) % 3] = corner[(axis + 1) % 3] + edge * (k % SIDE + 0.5) / SIDE;
      at[(axis + 2) % 3] = corner[(axis + 2) % 3] + edge * (k / SIDE + 0.5) / SIDE;
      vt_ray ray = {vt_v3(at[0], at[1], at[2]), vt_v3(along[0], along[1], along[2])};
      sum += vt_phantom_depth(p, &ray, 0, edge);
    }
  return sum / (3 * SIDE * SIDE * edge);
}

static void measure_chords(void *user, size_t begin, size_t end, int worker) {
  chord_job *job = user;
  (void)worker;
  vt_phantom near;
  double edge = job->grid->edge;
  for (size_t i = begin; i < end && !vt_cancelled(job->context); i++) {
    vt_vec3 o = job->grid->origin;
    const uint16_t *cell = job->xyz[i];
    double corner[3] = {o.x + cell[0] * edge, o.y + cell[1] * edge, o.z + cell[2] * edge};
    vt_vec3 centre = {corner[0] + 0.5 * edge, corner[1] + 0.5 * edge, corner[2] + 0.5 * edge};
    vt_phantom_near(job->phantom, centre, edge, &near);
    job->extinction[i] = (float)mean_of_chords(&near, corner, edge);
  }
}

vt_status vt_phantom_cells(vt_context *ctx, const vt_phantom *phantom, const vt_grid *grid, size_t count,
                           const uint16_t (*xyz)[3], float *extinction) {
  chord_job job = {phantom, grid, xyz, extinction, ctx};
  return vt_parallel(ctx, count, 256, measure_chords, &job);
}

// ---- clipping

enum { CORNER_LIMIT = 12 }; // a triangle cut by six planes has at most 9

typedef struct polygon {
  int count;
  double at[CORNER_LIMIT][3]; // in cells
} polygon;

// The part with side * (at[axis] - plane) >= 0.
static void cut(const polygon *in, int axis, double plane, double side, polygon *out) {
  out->count = 0;
  for (int i = 0; i < in->count; i++) {
    const double *a = in->at[i], *b = in->at[(i + 1) % in->count];
    double from = side * (a[axis] - plane), to = side * (b[axis] - plane);
    if (from >= 0) {
      for (int k = 0; k < 3; k++) out->at[out->count][k] = a[k];
      out->count++;
    }
    if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
      double share = from / (from - to);
      for (int k = 0; k < 3; k++) out->at[out->count][k] = a[k] + share * (b[k] - a[k]);
      out->at[out->count++][axis] = plane;
    }
  }
}

// The cells along an axis that a polygon has area in.
static void span_of(const polygon *p, int axis, int cells, int *first, int *last) {
  double low = p->at[0][axis], high = low;
  for (int i = 1; i < p->count; i++) low = fmin(low, p->at[i][axis]), high = fmax(high, p->at[i][axis]);
  double top = high > low ? ceil(high) - 1 : floor(high);
  if (low == cells && high == cells) low = top = cells - 1; // in the far face of the root
  *first = low < 0 ? 0 : low >= cells ? cells : (int)floor(low);
  *last = top < 0 ? -1 : top >= cells ? cells - 1 : (int)top;
}

static void take_slab(const polygon *in, int axis, int cell, polygon *out) {
  polygon half;
  cut(in, axis, cell, 1, &half);
  cut(&half, axis, cell + 1, -1, out);
}

static double area_of(const polygon *p) {
  double sum[3] = {0, 0, 0};
  for (int i = 1; i + 1 < p->count; i++) {
    double u[3], v[3];
    for (int k = 0; k < 3; k++) u[k] = p->at[i][k] - p->at[0][k], v[k] = p->at[i + 1][k] - p->at[0][k];
    for (int k = 0; k < 3; k++) sum[k] += u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  }
  return 0.5 * sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
}

// ---- slabs

typedef struct area_job {
  vt_context *context;
  const vt_mesh *mesh;
  const vt_grid *grid;
  const uint16_t (*xyz)[3];
  float *extinction, *area;
  const size_t *first_triangle, *first_cell; // [axis_cells + 1]: of each slab, in the lists below
  const uint32_t *triangles, *cells;
  double *sums; // [worker][axis_cells * axis_cells][2]: area of solids and of leaves, in squared cells; [y][z]
} area_job;

static polygon triangle_of(const vt_mesh *mesh, const vt_grid *grid, size_t t) {
  polygon p = {.count = 3};
  double origin[3] = {grid->origin.x, grid->origin.y, grid->origin.z};
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      p.at[i][k] = (mesh->vertices[mesh->triangles[t][i]].position[k] - origin[k]) / grid->edge;
  return p;
}

static void spread_piece(const polygon *piece, int cells, int kind, double *sums) {
  int y0, y1, z0, z1;
  span_of(piece, 1, cells, &y0, &y1);
  for (int y = y0; y <= y1; y++) {
    polygon row, part;
    take_slab(piece, 1, y, &row);
    if (row.count < 3) continue;
    span_of(&row, 2, cells, &z0, &z1);
    for (int z = z0; z <= z1; z++) {
      take_slab(&row, 2, z, &part);
      sums[2 * ((size_t)y * (size_t)cells + (size_t)z) + (size_t)kind] += area_of(&part);
    }
  }
}

static void measure_slabs(void *user, size_t begin, size_t end, int worker) {
  area_job *job = user;
  int cells = job->grid->axis_cells;
  size_t size = 2 * (size_t)cells * (size_t)cells;
  double *sums = job->sums + (size_t)worker * size, square = job->grid->edge * job->grid->edge;
  double cube = square * job->grid->edge;
  for (size_t x = begin; x < end && !vt_cancelled(job->context); x++) {
    if (job->first_cell[x] == job->first_cell[x + 1]) continue;
    for (size_t i = 0; i < size; i++) sums[i] = 0;
    for (size_t i = job->first_triangle[x]; i < job->first_triangle[x + 1]; i++) {
      polygon triangle = triangle_of(job->mesh, job->grid, job->triangles[i]), piece;
      take_slab(&triangle, 0, (int)x, &piece);
      if (piece.count > 2) spread_piece(&piece, cells, job->triangles[i] >= job->mesh->solid_count, sums);
    }
    for (size_t i = job->first_cell[x]; i < job->first_cell[x + 1]; i++) {
      size_t cell = job->cells[i];
      const double *sum = sums + 2 * ((size_t)job->xyz[cell][1] * (size_t)cells + job->xyz[cell][2]);
      job->extinction[cell] = (float)((0.5 * sum[0] + sum[1]) * square / (2 * cube));
      if (job->area) job->area[cell] = (float)(sum[1] * square);
    }
  }
}

// ---- lists of each slab

// Turns counts (one place higher) into the first index of each slab.
static void accumulate(size_t *first, int cells) {
  for (int x = 0; x < cells; x++) first[x + 1] += first[x];
}

// Counts the triangles of each slab where `list` is NULL; else lists them, `at` being where each slab's list has got
// to.
static void list_triangles(const area_job *job, size_t *at, uint32_t *list) {
  for (size_t t = 0; t < job->mesh->triangle_count; t++) {
    int first, last;
    polygon triangle = triangle_of(job->mesh, job->grid, t);
    span_of(&triangle, 0, job->grid->axis_cells, &first, &last);
    for (int x = first; x <= last; x++) {
      if (list) list[at[x]] = (uint32_t)t;
      at[x]++;
    }
  }
}

vt_status vt_mesh_cells(vt_context *ctx, const vt_mesh *mesh, const vt_grid *grid, size_t count,
                        const uint16_t (*xyz)[3], float *extinction, float *area) {
  VT_ASSERT(count < UINT32_MAX);
  size_t cells = (size_t)grid->axis_cells, workers = (size_t)vt_thread_count(ctx);
  area_job job = {.context = ctx, .mesh = mesh, .grid = grid, .xyz = xyz, .extinction = extinction, .area = area};
  size_t *starts = VT_NEW(ctx, size_t, 2 * (cells + 1)), *at = VT_NEW(ctx, size_t, cells);
  uint32_t *triangles = NULL, *listed = VT_NEW(ctx, uint32_t, count);
  vt_status status = VT_OUT_OF_MEMORY;
  job.sums = VT_NEW(ctx, double, 2 * workers * cells * cells);
  if (!starts || !at || !listed || !job.sums) goto done;
  size_t *first_triangle = starts, *first_cell = starts + cells + 1;
  list_triangles(&job, first_triangle + 1, NULL);
  accumulate(first_triangle, grid->axis_cells);
  triangles = VT_NEW(ctx, uint32_t, first_triangle[cells]);
  if (!triangles) goto done;
  for (size_t x = 0; x < cells; x++) at[x] = first_triangle[x];
  list_triangles(&job, at, triangles);
  for (size_t i = 0; i < count; i++) first_cell[xyz[i][0] + 1]++;
  accumulate(first_cell, grid->axis_cells);
  for (size_t x = 0; x < cells; x++) at[x] = first_cell[x];
  for (size_t i = 0; i < count; i++) listed[at[xyz[i][0]]++] = (uint32_t)i;
  job.first_triangle = first_triangle, job.first_cell = first_cell, job.triangles = triangles, job.cells = listed;
  status = vt_parallel(ctx, cells, 1, measure_slabs, &job);
done:
  vt_free(ctx, job.sums);
  vt_free(ctx, triangles);
  vt_free(ctx, listed);
  vt_free(ctx, at);
  vt_free(ctx, starts);
  return status;
}
