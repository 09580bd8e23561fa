// least_squares.h - non-linear least squares with bounds and a robust loss (Ceres; least_squares_none.c refuses)
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_LEAST_SQUARES_H
#define VT_BASE_LEAST_SQUARES_H

#include "base/context.h"

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_loss { VT_LOSS_NONE, VT_LOSS_HUBER } vt_loss;

// Residuals that depend on some groups of parameters. parameters[k]: values of group k; residuals[residual_count]; jacobians
// NULL, or jacobians[k] NULL or [residual_count][size of group k], row by row. False: the values cannot be judged (a step into
// them is taken back; at the start it is an error). Called from one thread at a time where thread_count is 1.
typedef bool (*vt_residual_function)(void *user, const double *const *parameters, double *residuals, double **jacobians);

typedef struct vt_parameter_group {
  double *values;             // [size] start, and result; borrowed
  int size;                   // >= 1
  const double *least, *most; // [size] bounds, or NULL: none
  bool constant;              // not to be changed
  bool eliminated;            // solved for in terms of the others (Schur): many small groups, no two of them in one block
} vt_parameter_group;

typedef struct vt_residual_block {
  vt_residual_function evaluate;
  void *user;
  int residual_count;
  int group_count;
  const int *groups; // [group_count] numbers of the groups it depends on, each once
} vt_residual_block;

typedef struct vt_least_squares_desc {
  uint32_t cookie;
  int iterations;             // at most, >= 0
  double function_tolerance;  // stop when the cost changes by less than this share
  double gradient_tolerance;  // or the largest entry of the projected gradient is below this
  double parameter_tolerance; // or the parameters change by less than this share
  int thread_count;           // 1: the same bits each time
  vt_loss loss;               // of the squared norm of each block
  double loss_width;          // norm of a block beyond which it counts linearly, > 0
} vt_least_squares_desc;
vt_least_squares_desc vt_default_least_squares_desc(void);

typedef struct vt_least_squares_report {
  double initial_cost, final_cost; // half the sum of the losses
  int iterations;
  bool converged;                  // false: stopped by `iterations`
} vt_least_squares_report;

// Huber's loss as a residual, for blocks whose residuals are not all to be softened alike: r' with r'^2 / 2 = the loss of r, which
// is quadratic up to `width` and linear from there, and dr'/dr.
static inline double vt_huber(double r, double width, double *slope) {
  double size = fabs(r);
  *slope = 1;
  if (size <= width) return r;
  double root = sqrt(width * (2 * size - width));
  *slope = width / root;
  return r < 0 ? -root : root;
}
// The same for the length of a residual in the plane, in place. map: d new / d old, row by row.
static inline void vt_huber_plane(double r[2], double width, double map[4]) {
  double size = sqrt(r[0] * r[0] + r[1] * r[1]), slope, along;
  map[0] = map[3] = 1, map[1] = map[2] = 0;
  if (size <= width) return;
  along = vt_huber(size, width, &slope) / size;
  double x = r[0] / size, y = r[1] / size, more = slope - along;
  map[0] = along + more * x * x, map[1] = map[2] = more * x * y, map[3] = along + more * y * y;
  r[0] *= along, r[1] *= along;
}

bool vt_can_solve_least_squares(void); // false in builds without Ceres

// Bounds are kept exactly, but Ceres projects its steps: along an active bound in a curved valley it may stop some tenths of a
// percent above the least cost. Where that matters, square a parameter instead of bounding it.
//
// Lowers 1/2 sum_blocks loss(|residuals|^2). VT_BAD_INPUT naming `name` where the start cannot be judged or lies outside
// its bounds, VT_FAILED where no step can be made, VT_MISSING_PROGRAM without Ceres, VT_OUT_OF_MEMORY.
vt_status vt_solve_least_squares(vt_context *, const vt_least_squares_desc *, const char *name, int group_count,
                                 const vt_parameter_group *groups, int block_count, const vt_residual_block *blocks,
                                 vt_least_squares_report *or_null);

#ifdef __cplusplus
}
#endif
#endif
