// bench_frontier.h - what the suite frontier has measured on one capture, and how it becomes tables, plots and pictures
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_BENCH_FRONTIER_H
#define VT_PROGRAMS_BENCH_FRONTIER_H

#include "programs/bench_peers.h"
#include "reconstruct/reconstruct.h"

#define VT_MAX_FRONTIER_RUNS 24
#define VT_FRONTIER_PREDICTORS 2 // nearest photograph, visual hull with mean colours

typedef enum vt_run_stage {
  VT_RUN_TOTAL, VT_RUN_TOTAL_CPU, VT_RUN_RECONSTRUCT, VT_RUN_RECONSTRUCT_CPU,
  VT_RUN_BOUNDS, VT_RUN_HULL, VT_RUN_RAYS, VT_RUN_OPACITY, VT_RUN_COLOUR, VT_RUN_REFINEMENT, VT_RUN_TILES, // of the report
  VT_RUN_COMPRESS, VT_RUN_FRAME, VT_RUN_STAGE_COUNT
} vt_run_stage;

typedef struct vt_frontier_run {
  char series[40], point[24]; // its row is called "series/point"
  vt_method method;
  vt_preset preset;
  double budget; // seconds; 0: none
  int repetitions;
  double seconds[VT_RUN_STAGE_COUNT][VT_MAX_REPETITIONS];
  vt_metrics raw[VT_MAX_REPETITIONS], packed[VT_MAX_REPETITIONS]; // [repetitions] before and after packing
  double textures[2][VT_MAX_REPETITIONS], file[2][VT_MAX_REPETITIONS]; // bytes before [0] and after [1] packing
  double peak_bytes[VT_MAX_REPETITIONS];                               // beyond the photographs
  int leaf_level;
  vt_pictures pictures; // packed; only the first has pixels where there are no peers; owned
} vt_frontier_run;

typedef struct vt_frontier_predictor {
  vt_predictor predictor;
  vt_spread seconds;
  vt_metrics metrics;
  vt_pictures pictures; // owned
} vt_frontier_predictor;

typedef struct vt_frontier_peer {
  const vt_peer *peer;
  double budget;
  vt_peer_result result; // owned
} vt_frontier_peer;

typedef struct vt_frontier {
  vt_bench *bench;
  vt_session *session;
  vt_context *context;
  vt_peers peers;
  char *scratch;                    // folder; owned
  double steps_done, steps_total;   // seconds, roughly
  char name[100];                   // of the capture
  vt_views views, training, judged; // training and judged: free their items only
  vt_vec3 centre;                   // of the tree, world
  int run_count;
  vt_frontier_run runs[VT_MAX_FRONTIER_RUNS];
  vt_frontier_predictor predictors[VT_FRONTIER_PREDICTORS];
  int peer_run_count;
  vt_frontier_peer *peer_runs; // owned
} vt_frontier;

// Adds the capture's tables, plots, pictures and sentences to the report.
vt_status vt_put_frontier(vt_frontier *);
// Runs the solvers of opacity on the capture, and adds their table and plot (bench_solvers.c).
vt_status vt_put_solvers(vt_frontier *);

#endif
