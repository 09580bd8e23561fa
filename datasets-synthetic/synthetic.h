// synthetic.h - trees and phantoms with known truth, photographed with exact cameras and mattes, and damaged on request
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_DATASETS_SYNTHETIC_SYNTHETIC_H
#define VT_DATASETS_SYNTHETIC_SYNTHETIC_H

#include "base/views.h"

#ifdef __cplusplus
extern "C" {
#endif

// ==== what is photographed ===========================================================================================

typedef enum vt_synthetic_kind {
  VT_SYNTHETIC_TREE,      // a broad-leaved tree whose whole habit is drawn from the seed
  VT_SYNTHETIC_OAK,       // dense crown, 150,000 lobed leaves and more   [the oak of LRMDM06]
  VT_SYNTHETIC_PINE,      // whorls of branches, needles in clusters      [its pine]
  VT_SYNTHETIC_SMALL_OAK, // sparse crown of some thousand leaves         [its small oak]
  VT_SYNTHETIC_BIRCH,     // slender, white bark, small leaves on fine hanging twigs
  VT_SYNTHETIC_WILLOW,    // long hanging twigs with narrow leaves
  VT_SYNTHETIC_MESH,      // a model made elsewhere: desc.mesh_path
  VT_SYNTHETIC_BALL,      // phantom: uniform extinction in a ball
  VT_SYNTHETIC_SHELL,     // phantom: a hollow ball
  VT_SYNTHETIC_BLOBS,     // phantom: Gaussian blobs of extinction
  VT_SYNTHETIC_COMB,      // phantom: a comb of thin plates, each thinner than a cell
  VT_SYNTHETIC_CROWN      // phantom: ellipsoids in ellipsoids in the manner of Shepp and Logan, laid out like a crown
} vt_synthetic_kind;
static inline bool vt_is_phantom(vt_synthetic_kind kind) { return kind >= VT_SYNTHETIC_BALL; }
const char *vt_synthetic_name(vt_synthetic_kind); // "tree", "oak", "pine", "small_oak", ...

typedef enum vt_rig {
  VT_RIG_SPIRAL,     // golden spiral between elevations of -5 and 60 degrees
  VT_RIG_RING,       // one loop at an elevation of 10 degrees
  VT_RIG_HEMISPHERE, // golden spiral over the whole upper half, from the horizon to straight above
  VT_RIG_ARC,        // forward-facing: 100 degrees of azimuth from one side, two heights
  VT_RIG_DRONE,      // three rising loops, the camera tilted down more and more, 15 to 65 degrees
  VT_RIG_HANDHELD    // one loop at walking height with jitter of place, aim and roll
} vt_rig;

typedef enum vt_backdrop {
  VT_BACKDROP_NONE,  // exact mattes in the alpha channel
  VT_BACKDROP_SKY,   // a gradient with clouds, different from every direction as a real sky is; opaque photographs
  VT_BACKDROP_STUDIO // dark cloth with folds, weave and a gradient of light; opaque photographs
} vt_backdrop;

typedef enum vt_light_path {
  VT_RASTERISED, // depth buffer, shadow map, baked sky: fast, in every build; textures of imported meshes not drawn
  VT_RAY_TRACED  // Embree: sun, sky, self-shadowing, translucent and specular leaves, textures; VT_MISSING_PROGRAM where
                 // the build has none
} vt_light_path;
bool vt_can_trace_rays(void);

typedef struct vt_synthetic_desc {
  uint32_t cookie;
  vt_synthetic_kind kind;
  uint32_t seed;
  const char *mesh_path; // VT_SYNTHETIC_MESH: .obj (with .mtl and textures), .gltf or .glb; scaled to 2 units high
  int train_count; // 1..1000
  int test_count;  // views between them, role VT_TEST, 0..1000
  int width, height; // pixels, 1..8192
  int supersample;   // samples per pixel edge for exact alpha, 1..8
  int leaf_count;    // grown trees: leaves, or needle clusters of the pine, 0 (bare)..1000000; -1: as many as the kind has.
                     // Fewer leaves are larger
  double fov_y;      // radians, 0.01..2.5
  double peak_extinction; // phantoms: per unit length, > 0, <= 1e6; the object has radius about 1
  vt_rig rig;
  vt_backdrop backdrop;
  vt_light_path light_path;
  int sun;     // 0: the seed's own direction of the sun; 1, 2, ...: others, for relighting (>= 0)
  double wind; // how far the tops of the leaves move from photograph to photograph, world units, 0..0.5; 0: still
} vt_synthetic_desc;
vt_synthetic_desc vt_default_synthetic_desc(void);

// Makes the object and photographs it, with exact mattes whatever the backdrop. Names are "train/r_0.png", ...; world z is
// up, the object about 2 units high around the origin. Same desc, same bits, for any number of threads. Caller frees `out`.
// VT_BAD_INPUT where a field is out of range, VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_make_synthetic_views(vt_context *, const vt_synthetic_desc *, vt_views *out);
// Puts desc.backdrop behind every picture: they become opaque (alpha 255). VT_BACKDROP_NONE changes nothing.
vt_status vt_put_before_backdrop(vt_context *, const vt_synthetic_desc *, vt_views *);

// ==== scenes with names, the same for tests, bench and player ========================================================

// A scene never changes under its name: tests/quality_table.csv and the figures of the bench would speak of something else.
const char *vt_scene_name(size_t i);                             // NULL behind the last one
bool vt_find_scene(const char *name, vt_synthetic_desc *out);    // false, and `out` untouched, if there is none

// ==== damage =========================================================================================================

// All amounts 0: nothing is done. Per-photograph amounts are drawn from a normal distribution of the given deviation.
typedef struct vt_damage_desc {
  uint32_t cookie;
  uint64_t seed;
  double noise;             // sensor noise at mid grey, deviation of encoded values, 0..0.5 (shot noise: it grows with the
                            // light, counted before the white balance)
  double blur;              // deviation of a Gaussian over the whole photograph, in linear light, pixels, 0..50
  int jpeg_quality;         // 1..100; 0: no JPEG. 4:2:0, the standard's tables
  double exposure;          // stops, per photograph, 0..4
  double white_balance;     // ln of the gains of red and of blue, per photograph, 0..1
  double distortion;        // k1 of the radial model, -0.5..0.5; the picture and its matte are bent, the camera still says
                            // pinhole. x_bent = x (1 + k1 r^2), x over z of the camera
  double pose_degrees;      // rotation of each camera about its centre that its pose does not know, 0..90
  double pose_share;        // displacement of each camera, share of its distance from the origin, 0..0.5
  double focal_share;       // one common relative error of the focal lengths (not drawn: exactly this), -0.5..0.5
  double matte_erosion;     // pixels, -16..16; negative: dilation
  double matte_blur;        // deviation of a Gaussian over alpha alone, pixels, 0..50
  double matte_holes;       // share of the covered area lost in round holes of 2 to 4 pixels across, 0..0.9
  double matte_noise;       // deviation of alpha, 0..1, before it is rounded to 8 bits; where nothing is, too
} vt_damage_desc;
vt_damage_desc vt_default_damage_desc(void); // no damage
// Changes pictures and cameras in place, in the order in which light meets these things: lens (distortion, then blur),
// exposure, sensor, white balance, JPEG, matte, pose. What a view draws depends on the seed and on its place among the views
// alone, not on other amounts. Photographs that are opaque everywhere (before a backdrop) have no matte to damage. Same desc,
// same bits, for any number of threads. VT_BAD_INPUT where an amount is out of range, VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_damage_views(vt_context *, const vt_damage_desc *, vt_views *);

// ==== tracks =========================================================================================================

// Points of the tree as a matcher of features would find them in its photographs.
typedef struct vt_track_desc {
  uint32_t cookie;
  uint64_t seed;
  int count;             // points that are looked for, >= 0; those that too few photographs see are left out
  int least_views;       // that must see a point, >= 2
  double widest_degrees; // between the lines of sight of the first that sees it and of another
  double noise;          // pixels, deviation along each axis
  double outlier_share;  // of sights that lie anywhere in their picture, 0..1
  double distortion;     // k1, as in vt_damage_desc
} vt_track_desc;
vt_track_desc vt_default_track_desc(void); // 1500 points, three views, 35 degrees, half a pixel, 2 %
// By the true cameras. Places are NaN: nobody has found them yet. Trees only (asserted). Same desc, same bits, for any number of
// threads. VT_MISSING_PROGRAM in builds without Embree, VT_BAD_INPUT, VT_OUT_OF_MEMORY.
vt_status vt_make_synthetic_tracks(vt_context *, const vt_synthetic_desc *, const vt_track_desc *, const vt_camera *true_cameras,
                                   int view_count, vt_tracks *out);

// ==== meshes =========================================================================================================

typedef struct vt_material {
  char name[64];
  float albedo[3];       // times the vertex' own and the texture's, linear light; above 1 where it makes up for a dark texture
  float translucency[3]; // light let through, as a share of light reflected, each channel; thin materials only
  float specular;        // reflectance at normal incidence, 0..1
  float roughness;       // 0 (mirror)..1
  float cutoff;          // texture alpha below this is a hole; 0: no holes
  bool thin;             // a two-sided sheet (leaf), not the surface of a solid
  vt_image texture;      // straight RGBA, sRGB-encoded, first row at v = 1; empty: none; owned
} vt_material;

typedef struct vt_vertex {
  float position[3]; // world, z up
  float normal[3];   // unit; of a leaf: of its upper side
  float albedo[3];   // linear light, 0..1
  float uv[2];       // texture coordinates
} vt_vertex;

typedef struct vt_mesh {
  size_t vertex_count, vertex_capacity;
  vt_vertex *vertices; // owned
  size_t triangle_count, triangle_capacity;
  uint32_t (*triangles)[3];      // owned; counter-clockwise seen from the side the normals point to
  uint16_t *triangle_materials;  // [triangle_capacity]; owned
  size_t solid_count; // triangles before this one close a solid (bark); those from it on are thin, two-sided leaves
  int material_count;
  vt_material *materials; // [material_count]; owned, each with its texture
} vt_mesh;
void vt_free_mesh(vt_context *, vt_mesh *);
// The mesh of a grown tree or of desc.mesh_path, centred on the origin and 2 units high. Not for phantoms (asserted).
// Caller frees.
vt_status vt_make_synthetic_mesh(vt_context *, const vt_synthetic_desc *, vt_mesh *out);
// By the ending: .obj (y up in the file, as is the custom; with .mtl and PNG textures beside it), .gltf or .glb (2.0). World is
// z up. Reading takes polygons, negative indices, cut-out textures (map_Kd with alpha, map_d; alphaMode MASK and BLEND).
// VT_BAD_INPUT naming file and line or element; VT_FAILED where it cannot be written. Caller frees `out`.
vt_status vt_read_mesh(vt_context *, const char *path, vt_mesh *out);
vt_status vt_write_mesh(vt_context *, const vt_mesh *, const char *path);

// ==== truth ==========================================================================================================

// The object itself, to be asked. Shares no code with reconstruct/ or octree/. Made from the same desc as the photographs
// (without wind). Meshes need ray tracing (VT_MISSING_PROGRAM without).
typedef struct vt_truth vt_truth;
vt_status vt_create_truth(vt_context *, const vt_synthetic_desc *, vt_truth **out);
void vt_destroy_truth(vt_context *, vt_truth *); // NULL is allowed
// Optical depth along a ray between `near` and `far` (world distances along it). Phantoms: in closed form. Meshes: -ln of the
// share of 256 parallel rays, stratified over a disc of `radius` (world, > 0) around this one, that nothing stops; INFINITY
// where all are stopped.
double vt_true_optical_depth(const vt_truth *, const vt_ray *, double near, double far, double radius);
double vt_true_extinction(const vt_truth *, vt_vec3 point); // phantoms only (asserted): at a point, per world unit
// Cells of a cubic grid: origin (corner) and edge of the root, axis_cells along it; xyz[count]. extinction[count]: mean of the
// cell, per world unit (meshes: half the area of its surfaces, each solid's counted once in two, over its volume: the mean over
// all directions of what it would stop if it were spread evenly). area[count] or NULL: one-sided leaf area, world units squared
// (phantoms: 0). Exact for meshes (triangles are clipped to cells); phantoms from 4x4 closed-form chords along each axis.
vt_status vt_true_cells(vt_context *, const vt_truth *, vt_vec3 origin, double edge, int axis_cells, size_t count,
                        const uint16_t (*xyz)[3], float *extinction, float *area_or_null);
// One channel each, of the camera's size: alpha 0..1, and depth (z of the camera, world units; the nearest surface, or the
// mean of transmittance-weighted depth of a phantom; INFINITY where there is nothing). depth or NULL. Caller frees.
vt_status vt_true_view(vt_context *, const vt_truth *, const vt_camera *, int supersample, vt_fimage *alpha,
                       vt_fimage *depth_or_null);

#ifdef __cplusplus
}
#endif
#endif
