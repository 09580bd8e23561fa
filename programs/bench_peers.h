// bench_peers.h - foreign programs that are measured in the same run, through one small contract
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_BENCH_PEERS_H
#define VT_PROGRAMS_BENCH_PEERS_H

#include "programs/bench_judge.h"

// The contract: EXECUTABLE CAPTURE SECONDS OUT. CAPTURE holds transforms_train.json, transforms_test.json and
// images/*.png (straight RGBA); in about SECONDS the program learns from the first and writes pictures of the views of
// the second to OUT/NAME.png, where NAME is the last part of the view's file_path: RGBA, or RGB over a background that
// it says in a line "background R G B" (0..1). It may leave views out. After twice the time and half a minute it is
// ended.
typedef struct vt_peer {
  char *name, *executable; // owned
} vt_peer;
typedef struct vt_peers {
  int count;
  vt_peer *items; // owned
} vt_peers;
// Those of --peer NAME=EXECUTABLE and of the environment variable VOLTREE_PEERS (the same, separated by commas).
// VT_BAD_USAGE where one is not of that form or has the name of another.
vt_status vt_list_peers(vt_session *, vt_peers *out);
void vt_free_peers(vt_context *, vt_peers *);

// Writes the capture as the contract wants it. VT_FAILED naming the file.
vt_status vt_write_peer_capture(vt_context *, const vt_views *, const char *folder);

typedef struct vt_peer_result {
  double seconds;
  bool has_background;
  float background[3];
  int drawn;            // of the judged views
  vt_pictures pictures; // owned
  char trouble[600];    // a sentence about what went wrong; "" if nothing did
} vt_peer_result;
void vt_free_peer_result(vt_context *, vt_peer_result *);
// Runs the peer into the empty folder `out_folder`. What it does wrong is result->trouble, and no error.
vt_status vt_run_peer(vt_context *, const vt_peer *, const char *capture, double seconds, const char *out_folder,
                      const vt_views *judged, vt_peer_result *out);

#endif
