// habits.c - the numbers of each kind of tree
// SPDX-License-Identifier: BSD-3-Clause
//
// One row a kind; the code of growth knows no kinds. Trees are two units high whatever their age: for the oak read a unit
// as 8 m, for the pine as 4 m, for the small oak as 3 m. What is drawn from a span differs from seed to seed. The
// numbers of VT_SYNTHETIC_TREE may not be touched, not even in their last bit: a table in git judges the reconstruction of
// its trees.
//
// Albedos of leaves and bark are near the measured ones in the visible (leaves 4 to 6 % red, 10 to 15 % green, 3 to 5 %
// blue; birch bark about 45 %, its dark marks counted). What a leaf lets through is about as much as it reflects, with less blue.

#include "datasets-synthetic/habits.h"

static const vt_habit broad_leaved = {
    .crown = {.base = {0.48, 0.74}, .radius = {0.58, 0.92}, .skew = {0.62, 1.15}, .power = {0.45, 0.8},
              .leader = {0.15, 0.7}, .lean = 0.09, .rise = {0.35, 0.75},
              .point_count = 4200, .clump_low = 26, .clump_range = 22, .clump_radius = {0.15, 0.29}, .stray_share = 0.22,
              .step = 0.028, .kill = 0.05, .influence = 0.42, .bud_spacing = 4, .wander = 0.22, .keep = 0.35},
    .wood = {.pipe = {2.05, 2.3}, .trunk_radius = {0.042, 0.062}, .tip_floor = 0.0016, .twig_sides = 4,
             .light = {0.75, 1.35}, .ridge = {0.65, 1.3}, .speckle = {0.8, 1.2},
             .bark = {0.135, 0.118, 0.1}, .browner = {0.02, -0.008, -0.032}, .twig_radius = 0.006},
    .pattern = VT_BARK_FISSURED,
    .foliage = {.own_count = 12000, .form = VT_LEAF_BEECH, .form_count = 4, .area = {6.5, 8.5}, .length = {0.004, 0.16},
                .leafy = 4, .tip_weight = 2.6, .outward = 0.85, .forward = 0.5, .sag = 0.22, .scatter = 0.35,
                .uprightness = {0.6, 1.1}, .least_stalk = 0.4, .stalked = true, .stand_off = {0.005, 0.03},
                .fold = {0.1, 0.6}, .droop = {0.03, 0.34},
                .green_count = 5,
                .greens = {{.068, .155, .030}, {.098, .185, .032}, {.045, .112, .030}, {.072, .132, .052}, {.060, .150, .024}},
                .autumn = {.250, .140, .022},
                .translucency = {0.62f, 0.66f, 0.3f}, .specular = 0.04f, .roughness = 0.45f}};

static const vt_habit oak = {
    .crown = {.base = {0.36, 0.48}, .radius = {0.84, 0.98}, .skew = {0.66, 0.84}, .power = {0.42, 0.56},
              .leader = {0.25, 0.45}, .lean = 0.05, .rise = {0.28, 0.5},
              .point_count = 4000, .clump_low = 38, .clump_range = 14, .clump_radius = {0.14, 0.24}, .stray_share = 0.18,
              .step = 0.026, .kill = 0.056, .influence = 0.4, .bud_spacing = 6, .wander = 0.42, .keep = 0.3},
    .hanging = {.count = 11000, .length = {0.04, 0.13}, .from = 6, .outward = 0.35, .lift = 0.25, .limp = 0.03,
                .drift = 1, .wander = 0.5, .clearance = 0.3, .side_share = 0.3, .step = 0.03},
    .wood = {.pipe = {2.2, 2.4}, .trunk_radius = {0.07, 0.085}, .tip_floor = 0.0012, .twig_sides = 3,
             .light = {0.75, 1.35}, .ridge = {0.65, 1.3}, .speckle = {0.8, 1.2},
             .bark = {0.12, 0.1, 0.08}, .browner = {0.02, 0.004, -0.012}, .twig_radius = 0.005},
    .pattern = VT_BARK_FISSURED,
    .foliage = {.own_count = 160000, .form = VT_LEAF_OAK, .form_count = 1, .area = {14, 16}, .length = {0.004, 0.16},
                .leafy = 2.4, .tip_weight = 1, .outward = 0.8, .forward = 0.5, .sag = 0.12, .scatter = 0.5,
                .uprightness = {0.7, 0.95}, .least_stalk = 0.3, .stand_off = {0.002, 0.026}, .fold = {0.1, 0.5},
                .droop = {0.02, 0.25},
                .green_count = 3, .greens = {{.058, .128, .026}, {.066, .138, .024}, {.050, .115, .027}},
                .translucency = {0.6f, 0.68f, 0.28f}, .specular = 0.04f, .roughness = 0.42f}};

static const vt_habit pine = {
    .whorls = {.years_low = 12, .years_range = 4, .branch_low = 4, .branch_range = 3, .base = {0.26, 0.42},
               .radius = {0.6, 0.76}, .taper = 0.66, .low_rise = -0.08, .high_rise = 0.95, .upturn = 0.75, .shoot = 0.082,
               .fork = 0.85, .side = {0.45, 0.68}, .missing = 0.1, .step = 0.026},
    .wood = {.pipe = {2.1, 2.3}, .trunk_radius = {0.031, 0.038}, .tip_floor = 0.0018, .twig_sides = 4,
             .light = {0.75, 1.35}, .ridge = {0.65, 1.3}, .speckle = {0.8, 1.2},
             .bark = {0.13, 0.1, 0.082}, .browner = {0.02, 0.004, -0.01}, .high = {0.33, 0.165, 0.075},
             .twig = {0.17, 0.125, 0.075}, .twig_radius = 0.0055},
    .pattern = VT_BARK_PLATES,
    .foliage = {.own_count = 12000, .form = VT_LEAF_NEEDLES, .form_count = 1, .area = {6.2, 7.4}, .length = {0.02, 0.2},
                .leafy = 1.75, .tip_weight = 2.2, .outward = 0.7, .forward = 1, .sag = -0.25, .scatter = 0.15,
                .uprightness = {0.5, 0.8}, .stand_off = {0, 0}, .fold = {0, 0}, .droop = {-0.08, 0.14},
                .green_count = 3, .greens = {{.046, .088, .034}, {.050, .092, .044}, {.054, .100, .030}},
                .translucency = {0.16f, 0.2f, 0.08f}, .specular = 0.04f, .roughness = 0.4f}};

static const vt_habit small_oak = {
    .crown = {.base = {0.42, 0.56}, .radius = {0.54, 0.68}, .skew = {0.75, 0.95}, .power = {0.5, 0.7},
              .leader = {0.3, 0.55}, .lean = 0.07, .rise = {0.35, 0.6},
              .point_count = 900, .clump_low = 18, .clump_range = 10, .clump_radius = {0.13, 0.22}, .stray_share = 0.3,
              .step = 0.028, .kill = 0.07, .influence = 0.45, .bud_spacing = 4, .wander = 0.4, .keep = 0.3},
    .wood = {.pipe = {2.1, 2.3}, .trunk_radius = {0.028, 0.036}, .tip_floor = 0.0018, .twig_sides = 4,
             .light = {0.75, 1.35}, .ridge = {0.65, 1.3}, .speckle = {0.8, 1.2},
             .bark = {0.14, 0.12, 0.098}, .browner = {0.02, -0.002, -0.02}, .twig_radius = 0.006},
    .pattern = VT_BARK_FISSURED,
    .foliage = {.own_count = 4500, .form = VT_LEAF_OAK, .form_count = 1, .area = {1.9, 2.4}, .length = {0.01, 0.16},
                .leafy = 2.4, .tip_weight = 3, .outward = 0.8, .forward = 0.5, .sag = 0.15, .scatter = 0.45,
                .uprightness = {0.7, 0.95}, .least_stalk = 0.12, .stand_off = {0, 0.01}, .fold = {0.1, 0.5},
                .droop = {0.03, 0.3},
                .green_count = 3, .greens = {{.074, .158, .028}, {.066, .145, .026}, {.084, .165, .030}},
                .translucency = {0.62f, 0.7f, 0.3f}, .specular = 0.04f, .roughness = 0.42f}};

static const vt_habit birch = {
    .crown = {.base = {0.36, 0.5}, .radius = {0.29, 0.37}, .skew = {0.62, 0.8}, .power = {0.7, 0.95},
              .leader = {0.94, 1.04}, .lean = 0.04, .rise = {0.7, 1},
              .point_count = 1500, .clump_low = 40, .clump_range = 12, .clump_radius = {0.12, 0.2}, .stray_share = 0.45,
              .step = 0.026, .kill = 0.045, .influence = 0.36, .bud_spacing = 3, .wander = 0.18, .keep = 0.5},
    .hanging = {.count = 1900, .length = {0.1, 0.34}, .from = 5, .outward = 0.5, .lift = 0.25, .limp = 0.2, .drift = 0.22,
                .wander = 0.12, .clearance = 0.4, .side_share = 0.3, .step = 0.026},
    .wood = {.pipe = {2.15, 2.35}, .trunk_radius = {0.032, 0.04}, .tip_floor = 0.0011, .twig_sides = 3,
             .light = {0.9, 1.12}, .ridge = {0.92, 1.06}, .speckle = {0.94, 1.05},
             .bark = {0.43, 0.415, 0.385}, .browner = {0.03, 0.008, -0.03}, .twig = {0.075, 0.048, 0.038},
             .twig_radius = 0.0075},
    .pattern = VT_BARK_BIRCH,
    .foliage = {.own_count = 42000, .form = VT_LEAF_BIRCH, .form_count = 1, .area = {2.9, 3.5}, .length = {0.004, 0.12},
                .leafy = 2.2, .tip_weight = 1, .outward = 0.7, .forward = 0.35, .sag = 0.6, .scatter = 0.35,
                .uprightness = {0.35, 0.6}, .least_stalk = 0.5, .stalked = true, .stand_off = {0.003, 0.016},
                .fold = {0.05, 0.3}, .droop = {0.02, 0.2},
                .green_count = 3, .greens = {{.088, .172, .030}, {.080, .160, .034}, {.098, .178, .028}},
                .translucency = {0.66f, 0.74f, 0.3f}, .specular = 0.04f, .roughness = 0.38f}};

static const vt_habit willow = {
    .crown = {.base = {0.72, 0.86}, .radius = {0.58, 0.7}, .skew = {0.9, 1.1}, .power = {0.42, 0.55},
              .leader = {0.1, 0.3}, .lean = 0.08, .rise = {0.4, 0.6},
              .point_count = 2600, .clump_low = 34, .clump_range = 12, .clump_radius = {0.14, 0.24}, .stray_share = 0.3,
              .step = 0.028, .kill = 0.055, .influence = 0.42, .bud_spacing = 4, .wander = 0.24, .keep = 0.4},
    .hanging = {.count = 2500, .length = {0.4, 1.4}, .from = 3, .outward = 1.4, .lift = 0.3, .limp = 0.19, .drift = 0.13,
                .wander = 0.07, .clearance = 0.17, .side_share = 0.25, .step = 0.042},
    .wood = {.pipe = {2.2, 2.4}, .trunk_radius = {0.07, 0.085}, .tip_floor = 0.0011, .twig_sides = 3,
             .light = {0.75, 1.35}, .ridge = {0.65, 1.3}, .speckle = {0.8, 1.2},
             .bark = {0.13, 0.112, 0.088}, .browner = {0.02, 0.004, -0.012}, .twig = {0.21, 0.18, 0.065},
             .twig_radius = 0.006},
    .pattern = VT_BARK_FISSURED,
    .foliage = {.own_count = 60000, .form = VT_LEAF_WILLOW, .form_count = 1, .area = {11, 12.5}, .length = {0.008, 0.15},
                .leafy = 2.3, .tip_weight = 1, .outward = 0.55, .forward = 0.9, .sag = 0.35, .scatter = 0.2,
                .uprightness = {0.5, 0.8}, .least_stalk = 0.05, .stand_off = {0, 0.004}, .fold = {0.1, 0.4},
                .droop = {0.05, 0.35},
                .green_count = 3, .greens = {{.094, .165, .048}, {.086, .155, .056}, {.104, .172, .042}},
                .translucency = {0.58f, 0.66f, 0.32f}, .specular = 0.045f, .roughness = 0.36f}};

const vt_habit *vt_habit_of(vt_synthetic_kind kind) {
  switch (kind) {
    case VT_SYNTHETIC_TREE: return &broad_leaved;
    case VT_SYNTHETIC_OAK: return &oak;
    case VT_SYNTHETIC_PINE: return &pine;
    case VT_SYNTHETIC_SMALL_OAK: return &small_oak;
    case VT_SYNTHETIC_BIRCH: return &birch;
    case VT_SYNTHETIC_WILLOW: return &willow;
    default: VT_ASSERT(false); return NULL;
  }
}
