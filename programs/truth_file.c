// truth_file.c - truth.json: what a synthetic capture shows, and how it was damaged
// SPDX-License-Identifier: BSD-3-Clause
//
// Fields have the names of vt_synthetic_desc and vt_damage_desc. A field that is missing has the value that it has by
// default, so that older files stay readable when a field is added.
#include "programs/truth_file.h"

#include "base/file.h"
#include "base/json.h"

#include <string.h>
#include <unistd.h>

static const char *const rigs[] = {"spiral", "ring", "hemisphere", "arc", "drone", "handheld", NULL};
static const char *const backdrops[] = {"none", "sky", "studio", NULL};
static const char *const lights[] = {"raster", "trace", NULL};

// ---- writing

static void put_desc(vt_json_writer *json, const vt_synthetic_desc *d, const char *mesh_path) {
  vt_json_open_object(json, "object");
  vt_json_put_string(json, "kind", vt_synthetic_name(d->kind));
  vt_json_put_integer(json, "seed", d->seed);
  if (mesh_path) vt_json_put_string(json, "mesh_path", mesh_path);
  vt_json_put_integer(json, "train_count", d->train_count);
  vt_json_put_integer(json, "test_count", d->test_count);
  vt_json_put_integer(json, "width", d->width);
  vt_json_put_integer(json, "height", d->height);
  vt_json_put_integer(json, "supersample", d->supersample);
  vt_json_put_integer(json, "leaf_count", d->leaf_count);
  vt_json_put_number(json, "fov_y", d->fov_y);
  vt_json_put_number(json, "peak_extinction", d->peak_extinction);
  vt_json_put_string(json, "rig", rigs[d->rig]);
  vt_json_put_string(json, "backdrop", backdrops[d->backdrop]);
  vt_json_put_string(json, "light_path", lights[d->light_path]);
  vt_json_put_integer(json, "sun", d->sun);
  vt_json_put_number(json, "wind", d->wind);
  vt_json_close_object(json);
}

static void put_damage(vt_json_writer *json, const vt_damage_desc *d) {
  vt_json_open_object(json, "damage");
  vt_json_put_integer(json, "seed", (long long)d->seed);
  vt_json_put_number(json, "noise", d->noise);
  vt_json_put_number(json, "blur", d->blur);
  vt_json_put_integer(json, "jpeg_quality", d->jpeg_quality);
  vt_json_put_number(json, "exposure", d->exposure);
  vt_json_put_number(json, "white_balance", d->white_balance);
  vt_json_put_number(json, "distortion", d->distortion);
  vt_json_put_number(json, "pose_degrees", d->pose_degrees);
  vt_json_put_number(json, "pose_share", d->pose_share);
  vt_json_put_number(json, "focal_share", d->focal_share);
  vt_json_put_number(json, "matte_erosion", d->matte_erosion);
  vt_json_put_number(json, "matte_blur", d->matte_blur);
  vt_json_put_number(json, "matte_holes", d->matte_holes);
  vt_json_put_number(json, "matte_noise", d->matte_noise);
  vt_json_close_object(json);
}

vt_status vt_write_truth_file(vt_context *context, const vt_synthetic_desc *desc, const vt_damage_desc *damage,
                              const char *folder) {
  vt_json_writer json = vt_begin_json(context);
  char *text = NULL, *path = NULL, *whole = NULL, here[4096];
  size_t size = 0;
  if (desc->mesh_path && getcwd(here, sizeof here)) // who evaluates may stand in another folder
    whole = vt_join(context, here, desc->mesh_path);
  vt_json_open_object(&json, NULL);
  vt_json_put_string(&json, "generator", "voltree"); // write_capture.c knows by this that the file may be replaced
  put_desc(&json, desc, whole ? whole : desc->mesh_path);
  put_damage(&json, damage);
  vt_json_close_object(&json);
  vt_free(context, whole);
  vt_status status = vt_end_json(&json, &text, &size);
  if (!status) path = vt_join(context, folder, "truth.json");
  if (!status) status = path ? vt_write_file(context, path, text, size) : VT_OUT_OF_MEMORY;
  vt_free(context, path);
  vt_free(context, text);
  return status;
}

// ---- reading

typedef struct reader {
  vt_context *context;
  const char *path;
  const vt_json *object;
  vt_status status;
} reader;

static double read_number(reader *r, const char *key, double fallback, double low, double high) {
  const vt_json *member = vt_json_member(r->object, key);
  double value = vt_json_number(member, member ? (double)NAN : fallback);
  if (value >= low && value <= high) return value;
  r->status = vt_fail(r->context, VT_BAD_INPUT, "%s: \"%s\" is not a number from %g to %g; make the capture again",
                      r->path, key, low, high);
  return fallback;
}

static int read_whole(reader *r, const char *key, int fallback, double low, double high) {
  return (int)read_number(r, key, fallback, low, high);
}

static int read_word(reader *r, const char *key, const char *const *words, int fallback) {
  const char *word = vt_json_string(vt_json_member(r->object, key), words[fallback]);
  for (int i = 0; words[i]; i++)
    if (!strcmp(word, words[i])) return i;
  r->status = vt_fail(r->context, VT_BAD_INPUT,
                      "%s: \"%s\" is \"%s\", which is none that is known; make the capture again", r->path, key, word);
  return fallback;
}

static void read_desc(reader *r, vt_synthetic_desc *d) {
  const char *kinds[VT_SYNTHETIC_CROWN + 2] = {NULL};
  for (int i = 0; i <= VT_SYNTHETIC_CROWN; i++) kinds[i] = vt_synthetic_name((vt_synthetic_kind)i);
  d->kind = (vt_synthetic_kind)read_word(r, "kind", kinds, (int)d->kind);
  d->seed = (uint32_t)read_number(r, "seed", d->seed, 0, UINT32_MAX);
  d->train_count = read_whole(r, "train_count", d->train_count, 1, 1000);
  d->test_count = read_whole(r, "test_count", d->test_count, 0, 1000);
  d->width = read_whole(r, "width", d->width, 1, 8192);
  d->height = read_whole(r, "height", d->height, 1, 8192);
  d->supersample = read_whole(r, "supersample", d->supersample, 1, 8);
  d->leaf_count = read_whole(r, "leaf_count", d->leaf_count, -1, 1000000);
  d->fov_y = read_number(r, "fov_y", d->fov_y, 0.01, 2.5);
  d->peak_extinction = read_number(r, "peak_extinction", d->peak_extinction, 1e-6, 1e6);
  d->rig = (vt_rig)read_word(r, "rig", rigs, (int)d->rig);
  d->backdrop = (vt_backdrop)read_word(r, "backdrop", backdrops, (int)d->backdrop);
  d->light_path = (vt_light_path)read_word(r, "light_path", lights, (int)d->light_path);
  d->sun = read_whole(r, "sun", d->sun, 0, 1e6);
  d->wind = read_number(r, "wind", d->wind, 0, 0.5);
}

// The path of truth.json for a folder or a file in one. Free with vt_free; NULL only without memory.
static char *find_file(vt_context *context, const char *source) {
  char *folder = vt_strdup(context, source);
  if (folder && !vt_is_folder(source)) {
    char *slash = strrchr(folder, '/');
    if (slash)
      slash[slash == folder] = 0;
    else
      folder[0] = 0;
  }
  char *path = folder ? vt_join(context, folder, "truth.json") : NULL;
  vt_free(context, folder);
  return path;
}

vt_status vt_read_truth_file(vt_context *context, const char *source, vt_synthetic_desc *out, char **mesh_text) {
  char *path = find_file(context, source);
  vt_json *root = NULL;
  *mesh_text = NULL;
  if (!path) return VT_OUT_OF_MEMORY;
  vt_status status = VT_OK;
  if (!vt_is_file(path))
    status = vt_fail(context, VT_BAD_INPUT,
                     "%s: is not there; only captures that voltree synth made know the truth, leave out --truth", path);
  if (!status) status = vt_read_json(context, path, &root);
  if (!status) {
    *out = vt_default_synthetic_desc();
    reader r = {context, path, vt_json_member(root, "object"), VT_OK};
    if (r.object)
      read_desc(&r, out);
    else
      r.status = vt_fail(context, VT_BAD_INPUT, "%s: says nothing of an \"object\"; make the capture again", path);
    const char *mesh = vt_json_string(vt_json_member(r.object, "mesh_path"), NULL);
    status = r.status;
    if (!status && mesh && !(*mesh_text = vt_strdup(context, mesh))) status = VT_OUT_OF_MEMORY;
    if (!status && out->kind == VT_SYNTHETIC_MESH && !mesh)
      status = vt_fail(context, VT_BAD_INPUT, "%s: does not say which mesh; make the capture again", path);
    out->mesh_path = *mesh_text;
  }
  vt_free_json(context, root);
  vt_free(context, path);
  return status;
}
