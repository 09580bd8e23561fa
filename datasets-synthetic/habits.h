// habits.h - what makes one kind of tree differ from another, as numbers
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_HABITS_H
#define VT_DATASETS_SYNTHETIC_HABITS_H

#include "base/vector.h"
#include "datasets-synthetic/synthetic.h"

typedef struct vt_span { double low, high; } vt_span; // a seed draws evenly between the two

// The crown that branches fill by space colonisation (grow.c). A grown tree stands on z = 0 and is about 2 units high.
typedef struct vt_crown {
  vt_span base;         // height of its lower end, world units; the upper end is at 2
  vt_span radius;       // greatest radius, world units
  vt_span skew, power;  // profile: (sin(pi h^skew))^power over relative height h
  vt_span leader;       // how far up the crown the trunk is given, 0..1
  double lean;          // of the trunk, at most, per unit of height, each way
  vt_span rise;         // preference for lower nodes, 0: none
  int point_count;      // attraction points
  int clump_low, clump_range; // clumps of points: low..low + range - 1
  vt_span clump_radius; // for a crown of radius 0.75, world units
  double stray_share;   // of points that belong to no clump
  double step, kill, influence; // D, d_k, d_i, world units
  int bud_spacing;      // the trunk branches at every so many nodes only
  double wander, keep;  // noise of growth, and straightness, against the pull of the points
} vt_crown;

// Wood with a whorl of branches for each year (whorls.c).
typedef struct vt_whorls {
  int years_low, years_range; // whorls: low..low + range - 1; 0: not grown so
  int branch_low, branch_range;
  vt_span base;           // height of the lowest whorl, world units
  vt_span radius;         // length of the longest branches, world units
  double taper;           // branch length goes with (1 - h)^taper
  double low_rise, high_rise; // elevation at which the lowest and the highest branches leave the trunk, radians
  double upturn;          // tips bend upwards: slope gained per world unit
  double shoot;           // length of a year's shoot on a branch, world units
  double fork;            // angle between a shoot and its side shoots, radians
  vt_span side;           // length of a side shoot over what is left of its parent
  double missing;         // share of branches lost
  double step;            // world units between nodes
} vt_whorls;

// Fine twigs that hang from the ends of the wood (hang.c).
typedef struct vt_hanging {
  int count; // 0: none
  vt_span length;    // world units
  double from;       // they spring from wood thinner than so many tips
  double outward;    // preference for wood far from the trunk: weight goes with distance^outward
  double lift;       // upward part of the first direction
  double limp;       // how fast they give way to gravity, per step
  double drift;      // how far from straight down they come to rest, slope
  double wander;     // noise per step
  double clearance;  // they end so far above the ground, at least, world units
  double side_share; // of twigs that spring from an earlier hanging twig
  double step;       // world units between nodes
} vt_hanging;

typedef struct vt_wood {
  vt_span pipe;         // n of the pipe model
  vt_span trunk_radius; // world units
  double tip_floor;     // no twig is thinner, world units
  int twig_sides;       // of the thinnest tubes
  vt_span light;         // of the seed, times the colour
  vt_span ridge;         // of each strip along a branch, times the colour
  vt_span speckle;       // of each vertex, times the colour
  vt_vec3 bark, browner; // linear light: bark + b browner, b of the seed, 0..1
  vt_vec3 high;          // colour of the upper trunk (zero: as below)
  vt_vec3 twig;          // colour of thin wood (zero: as the bark)
  double twig_radius;    // wood thinner than this is twig: no texture, smooth; world units
} vt_wood;

typedef enum vt_bark_pattern { VT_BARK_FISSURED, VT_BARK_PLATES, VT_BARK_BIRCH } vt_bark_pattern;

// The first four are taken in turn by VT_SYNTHETIC_TREE.
typedef enum vt_leaf_form {
  VT_LEAF_BEECH, VT_LEAF_LIME, VT_LEAF_MAPLE, VT_LEAF_SLENDER_OAK, VT_LEAF_OAK, VT_LEAF_BIRCH, VT_LEAF_WILLOW, VT_LEAF_NEEDLES
} vt_leaf_form;

enum { VT_GREEN_LIMIT = 5 };

typedef struct vt_foliage {
  int own_count;        // leaves, or clusters of needles, where the caller does not say
  vt_leaf_form form;
  int form_count;       // seeds take turns through so many forms from `form` on
  vt_span area;         // square units of leaf in the crown, one side
  vt_span length;       // of a leaf, at least and at most, world units
  double leafy;         // leaves sit on wood thinner than so many tips
  double tip_weight;    // a twig's last piece has so many times more of them
  double outward, forward, sag, scatter; // a leaf's direction: across its twig, along it, down, any
  vt_span uprightness;  // how much its upper side turns to the sky
  vt_span stand_off;    // stalk between twig and leaf, world units
  double least_stalk;   // and at least so much over the leaf's length
  bool stalked;         // the stalk is drawn
  vt_span fold, droop;  // along the midrib, towards the tip
  int green_count;
  vt_vec3 greens[VT_GREEN_LIMIT]; // linear light
  vt_vec3 autumn;       // one seed in eleven (zero: none)
  float translucency[3], specular, roughness; // of the material, as in vt_material
} vt_foliage;

typedef struct vt_habit {
  vt_crown crown;
  vt_whorls whorls;
  vt_hanging hanging;
  vt_wood wood;
  vt_bark_pattern pattern;
  vt_foliage foliage;
} vt_habit;

const vt_habit *vt_habit_of(vt_synthetic_kind); // grown kinds only (asserted)

#endif
