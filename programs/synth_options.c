// synth_options.c - the options of voltree synth, and the descs that they make
// SPDX-License-Identifier: BSD-3-Clause
//
// Options that can have no effect are refused rather than ignored: who asks for wind on a ball has something else in
// mind.
#include "programs/synth_options.h"

#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)

// The words of choices stand in the order of their enums.
const vt_option vt_synth_options[] = {
    {"scene", 0, VT_OPTION_TEXT, "NAME", 0, 0, false,
     "start from a named scene, like tree_96 or ball_256; the options below then change it"},
    {"kind", 0, VT_OPTION_CHOICE, "tree|oak|pine|small_oak|birch|willow|mesh|ball|shell|blobs|comb|crown", 0, 0, false,
     "a grown tree, a model from a file, or a phantom of known extinction; default: tree"},
    {"mesh", 0, VT_OPTION_TEXT, "FILE", 0, 0, false, "photograph this model (.obj, .gltf, .glb); --kind mesh"},
    {"seed", 0, VT_OPTION_INTEGER, "N", 0, 2147483647, false, "another tree for each N"},
    {"views", 0, VT_OPTION_INTEGER, "N", 1, 1000, false, "photographs to reconstruct from"},
    {"test-views", 0, VT_OPTION_INTEGER, "N", 0, 1000, false, "photographs to judge against"},
    {"size", 0, VT_OPTION_INTEGER, "N", 16, 8192, false, "pixels along an edge of square photographs"},
    {"width", 0, VT_OPTION_INTEGER, "N", 16, 8192, false, "pixels across, instead of --size"},
    {"height", 0, VT_OPTION_INTEGER, "N", 16, 8192, false, "pixels down, instead of --size"},
    {"fov", 0, VT_OPTION_NUMBER, "DEG", 1, 140, false, "angle of view from top to bottom, degrees"},
    {"supersample", 0, VT_OPTION_INTEGER, "N", 1, 8, false, "samples along an edge of a pixel, for soft mattes"},
    {"leaves", 0, VT_OPTION_INTEGER, "N", -1, 1000000, false,
     "about so many leaves (or needle clusters) on a grown tree; 0: bare; -1: as many as its kind has, the default of "
     "all kinds but tree"},
    {"peak-extinction", 0, VT_OPTION_NUMBER, "X", 1e-6, 1e6, false,
     "highest extinction of a phantom, per unit length; it is about 2 high"},
    {"rig", 0, VT_OPTION_CHOICE, "spiral|ring|hemisphere|arc|drone|handheld", 0, 0, false,
     "where the cameras stand: golden spiral up to 60 degrees, one loop, the whole upper half, 100 degrees from one "
     "side, "
     "three rising loops, or a walk with unsteady hands"},
    {"backdrop", 0, VT_OPTION_CHOICE, "none|sky|studio", 0, 0, false,
     "what stands behind; none: exact mattes in the alpha channel. Others make opaque photographs, and the exact "
     "mattes go "
     "to OUT/truth/mattes"},
    {"light", 0, VT_OPTION_CHOICE, "raster|trace", 0, 0, false,
     "how meshes are lit: shadow maps, or ray tracing (builds with Embree)"},
    {"sun", 0, VT_OPTION_INTEGER, "N", 0, 1000, false, "0: the seed's own direction of the sun; 1, 2, ...: others"},
    {"wind", 0, VT_OPTION_NUMBER, "X", 0, 0.5, false,
     "how far the tops move from photograph to photograph; the tree is about 2 high"},
    {"relight", 0, VT_OPTION_INTEGER, "N", 1, 100, false,
     "write the same views under N other suns into OUT/relight_1, OUT/relight_2, ..."},
    {"export", 0, VT_OPTION_TEXT, "FILE", 0, 0, false, "write the mesh too (.obj, .gltf, .glb)"},
    {0}};

const vt_option vt_damage_options[] = {
    {"damage-seed", 0, VT_OPTION_INTEGER, "N", 0, 2147483647, false, "other draws of all that follows"},
    {"damage-test-views", 0, VT_OPTION_FLAG, "", 0, 0, false,
     "damage the photographs to judge against too; default: they stay exact"},
    {"noise", 0, VT_OPTION_NUMBER, "X", 0, 0.5, false,
     "sensor noise, its deviation at mid grey, 0..1 being all grey values"},
    {"blur", 0, VT_OPTION_NUMBER, "PIXELS", 0, 50, false, "blur of the lens, deviation of a Gaussian"},
    {"jpeg", 0, VT_OPTION_INTEGER, "QUALITY", 1, 100, false,
     "loss of a JPEG of this quality, chroma at half resolution"},
    {"exposure", 0, VT_OPTION_NUMBER, "STOPS", 0, 4, false, "deviation of the exposure from photograph to photograph"},
    {"white-balance", 0, VT_OPTION_NUMBER, "X", 0, 1, false, "deviation of ln of the gains of red and of blue"},
    {"distortion", 0, VT_OPTION_NUMBER, "K1", -0.5, 0.5, false, "radial distortion that the camera does not know"},
    {"pose-error", 0, VT_OPTION_NUMBER, "DEG", 0, 90, false, "deviation of each camera's direction, degrees"},
    {"position-error", 0, VT_OPTION_NUMBER, "SHARE", 0, 0.5, false,
     "deviation of each camera's place, share of its distance"},
    {"focal-error", 0, VT_OPTION_NUMBER, "SHARE", -0.5, 0.5, false,
     "relative error of all focal lengths, exactly this"},
    {"matte-erosion", 0, VT_OPTION_NUMBER, "PIXELS", -16, 16, false,
     "mattes too small by so much; negative: too large"},
    {"matte-blur", 0, VT_OPTION_NUMBER, "PIXELS", 0, 50, false, "mattes blurred, deviation of a Gaussian"},
    {"matte-holes", 0, VT_OPTION_NUMBER, "SHARE", 0, 0.9, false,
     "share of the mattes' area lost in holes of 2 to 4 pixels"},
    {"matte-noise", 0, VT_OPTION_NUMBER, "X", 0, 1, false, "deviation of alpha, 0..1"},
    {0}};

bool vt_harms_mattes(const vt_damage_desc *d) {
  return d->matte_erosion != 0 || d->matte_blur > 0 || d->matte_holes > 0 || d->matte_noise > 0;
}

bool vt_harms_cameras(const vt_damage_desc *d) {
  return d->pose_degrees > 0 || d->pose_share > 0 || d->focal_share != 0 || d->distortion != 0;
}

static vt_damage_desc damage_of(const vt_arguments *a) {
  vt_damage_desc d = vt_default_damage_desc();
  d.seed = (uint64_t)vt_integer_of(a, "damage-seed", 0);
  d.noise = vt_number_of(a, "noise", 0), d.blur = vt_number_of(a, "blur", 0);
  d.jpeg_quality = vt_integer_of(a, "jpeg", 0);
  d.exposure = vt_number_of(a, "exposure", 0), d.white_balance = vt_number_of(a, "white-balance", 0);
  d.distortion = vt_number_of(a, "distortion", 0);
  d.pose_degrees = vt_number_of(a, "pose-error", 0), d.pose_share = vt_number_of(a, "position-error", 0);
  d.focal_share = vt_number_of(a, "focal-error", 0);
  d.matte_erosion = vt_number_of(a, "matte-erosion", 0), d.matte_blur = vt_number_of(a, "matte-blur", 0);
  d.matte_holes = vt_number_of(a, "matte-holes", 0), d.matte_noise = vt_number_of(a, "matte-noise", 0);
  return d;
}

static vt_status start_from_scene(vt_session *session, vt_synthetic_desc *out) {
  const char *name = vt_text_of(&session->arguments, "scene", NULL);
  *out = vt_default_synthetic_desc();
  if (!name || vt_find_scene(name, out)) return VT_OK;
  char names[600] = "";
  for (size_t i = 0; vt_scene_name(i); i++) {
    size_t length = strlen(names);
    snprintf(names + length, sizeof names - length, "%s%s", i ? ", " : "", vt_scene_name(i));
  }
  return vt_fail(session->context, VT_BAD_USAGE, "--scene %s: no such scene; give one of %s", name, names);
}

static void change_desc(const vt_arguments *a, vt_synthetic_desc *d) {
  d->kind = (vt_synthetic_kind)vt_choice_of(a, "kind", vt_given(a, "mesh") ? VT_SYNTHETIC_MESH : (int)d->kind);
  d->mesh_path = vt_text_of(a, "mesh", d->mesh_path);
  d->seed = (uint32_t)vt_integer_of(a, "seed", (int)d->seed);
  d->train_count = vt_integer_of(a, "views", d->train_count);
  d->test_count = vt_integer_of(a, "test-views", d->test_count);
  d->width = vt_integer_of(a, "width", vt_integer_of(a, "size", d->width));
  d->height = vt_integer_of(a, "height", vt_integer_of(a, "size", d->height));
  if (vt_given(a, "fov")) d->fov_y = vt_number_of(a, "fov", 0) * DEGREE;
  d->supersample = vt_integer_of(a, "supersample", d->supersample);
  // A scene's number of leaves, and the default one, are of its own kind.
  bool own = vt_given(a, "kind") && d->kind != VT_SYNTHETIC_TREE && !vt_is_phantom(d->kind);
  d->leaf_count = vt_integer_of(a, "leaves", own ? -1 : d->leaf_count);
  d->peak_extinction = vt_number_of(a, "peak-extinction", d->peak_extinction);
  d->rig = (vt_rig)vt_choice_of(a, "rig", (int)d->rig);
  d->backdrop = (vt_backdrop)vt_choice_of(a, "backdrop", (int)d->backdrop);
  d->light_path = (vt_light_path)vt_choice_of(a, "light", (int)d->light_path);
  d->sun = vt_integer_of(a, "sun", d->sun);
  d->wind = vt_number_of(a, "wind", d->wind);
}

// The first of the given options among `names`, or NULL.
static const char *first_given(const vt_arguments *a, const char *const *names) {
  for (; *names; names++)
    if (vt_given(a, *names)) return *names;
  return NULL;
}

static bool ends_in(const char *path, const char *ending) {
  size_t length = strlen(path), tail = strlen(ending);
  return length > tail && !strcmp(path + length - tail, ending);
}

static vt_status check_plan(vt_session *session, const vt_synth_plan *plan) {
  static const char *const of_meshes[] = {"light", "sun", "wind", "relight", "export", NULL};
  static const char *const of_mattes[] = {"matte-erosion", "matte-blur", "matte-holes", "matte-noise", NULL};
  vt_context *context = session->context;
  const vt_arguments *a = &session->arguments;
  vt_synthetic_kind kind = plan->desc.kind;
  const char *name = vt_synthetic_name(kind), *found = vt_is_phantom(kind) ? first_given(a, of_meshes) : NULL;
  if (found)
    return vt_fail(context, VT_BAD_USAGE,
                   "--%s: a phantom (%s) has no surfaces; leave it out, or give a --kind of tree", found, name);
  if (vt_given(a, "leaves") && (vt_is_phantom(kind) || kind == VT_SYNTHETIC_MESH))
    return vt_fail(context, VT_BAD_USAGE, "--leaves: only grown trees have a number of leaves, not %s; leave it out",
                   name);
  if (vt_given(a, "peak-extinction") && !vt_is_phantom(kind))
    return vt_fail(context, VT_BAD_USAGE, "--peak-extinction: only phantoms have one, not %s; leave it out", name);
  if (vt_given(a, "mesh") && kind != VT_SYNTHETIC_MESH)
    return vt_fail(context, VT_BAD_USAGE, "--mesh: --kind is %s; give one of them", name);
  if (kind == VT_SYNTHETIC_MESH && !plan->desc.mesh_path)
    return vt_fail(context, VT_BAD_USAGE, "--kind mesh: which one is not said; give --mesh FILE");
  if (vt_given(a, "size") && (vt_given(a, "width") || vt_given(a, "height")))
    return vt_fail(context, VT_BAD_USAGE,
                   "--size: says width and height already; give it alone, or --width and --height");
  found = plan->desc.backdrop != VT_BACKDROP_NONE ? first_given(a, of_mattes) : NULL;
  if (found)
    return vt_fail(context, VT_BAD_USAGE,
                   "--%s: photographs before a backdrop carry no matte; give --backdrop none, or leave it out", found);
  found = plan->export_path;
  if (found && !ends_in(found, ".obj") && !ends_in(found, ".gltf") && !ends_in(found, ".glb"))
    return vt_fail(context, VT_BAD_USAGE, "--export %s: of no known kind; give a name that ends in .obj, .gltf or .glb",
                   found);
  return VT_OK;
}

vt_status vt_synth_plan_of(vt_session *session, vt_synth_plan *out) {
  const vt_arguments *a = &session->arguments;
  *out = (vt_synth_plan){.damage = damage_of(a)};
  vt_status status = start_from_scene(session, &out->desc);
  if (status) return status;
  change_desc(a, &out->desc);
  out->damage_test_views = vt_given(a, "damage-test-views");
  out->relight_count = vt_integer_of(a, "relight", 0);
  out->export_path = vt_text_of(a, "export", NULL);
  return check_plan(session, out);
}
