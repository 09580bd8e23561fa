// colmap_program.h - the colmap program: its version and options, its steps one by one, and what it says meanwhile
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_CAPTURE_COLMAP_PROGRAM_H
#define VT_CAPTURE_COLMAP_PROGRAM_H

#include "base/file.h"

#ifdef __cplusplus
extern "C" {
#endif

// What is known of a photograph from the extractor's words.
typedef struct vt_colmap_photo {
  int group;    // of photographs that share a camera, 0..
  int camera;   // its number in the database; 0: not known
  int features; // -1: not known
} vt_colmap_photo;

typedef struct vt_colmap {
  vt_context *context;
  const char *program;
  char version[24]; // "3.8"; "" where it does not say
  bool new_options, new_size, seeded; // of this version of the program
  char seed[16], threads[16];
  const vt_names *names;
  vt_colmap_photo *photos; // [names->count]
  int heard;               // the photograph that the extractor speaks of, or -1
  int features_before, features_wanted; // photographs, for progress over several calls of the extractor
  int registered;          // so far in this mapping, for progress
  char *images, *masks;    // folders; masks: black where no features are to be looked for, or NULL
  FILE *log;               // or NULL
  char last[512];          // the last line that said something
  bool last_is_error, help_seen;
} vt_colmap;

// How hard it tries.
typedef struct vt_colmap_effort {
  int max_image_size; // pixels of the longer side on which features are looked for
  bool affine;        // affine shape and domain-size pooling: features that bear more change of the point of view, slowly
  bool all_pairs;     // each photograph with each, else with those after it
  bool transitive;    // then also with the partners of its partners
  bool guided;        // matches are looked for once more along epipolar lines
  bool easier;        // a first pair of few inliers and a small angle will do
} vt_colmap_effort;

// Learns version and options. VT_MISSING_PROGRAM with the cure.
vt_status vt_probe_colmap(vt_colmap *);
// Takes a line that the program wrote, or wrote in an earlier run.
void vt_hear_colmap(vt_colmap *, const char *line);
// Features of the photographs of one group, listed in the file `list`; those in the database already are kept. If one of them
// has a camera it is theirs, else they get a new one.
vt_status vt_extract_features(vt_colmap *, const vt_colmap_effort *, const char *database, const char *list, int group);
// Pairs that are in the database already are kept.
vt_status vt_match_features(vt_colmap *, const vt_colmap_effort *, const char *database);
vt_status vt_forget_matches(vt_colmap *, const char *database);
// Models into folder/0, folder/1, ...; or, going on from `snapshot` (not NULL), one into `folder` itself. No model is not a
// failure, a crash is. Snapshots go into folder-snapshots.
vt_status vt_map_photographs(vt_colmap *, const vt_colmap_effort *, const char *database, const char *folder,
                             const char *snapshot_or_null, const char *snapshots);
// Takes observations out that err by more than `pixels`, or adjusts all cameras and points again. `to` must exist.
vt_status vt_filter_model(vt_colmap *, const char *from, const char *to, double pixels);
vt_status vt_adjust_model(vt_colmap *, const char *from, const char *to);

#ifdef __cplusplus
}
#endif
#endif
