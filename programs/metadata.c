// metadata.c - reading and extending the JSON inside a .vtree
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/metadata.h"

#include "programs/session.h"

#include <ctype.h>
#include <string.h>

vt_status vt_metadata_names(vt_context *context, const vt_tree *tree, const char *file, const char *key,
                            vt_names *out) {
  *out = (vt_names){0};
  vt_json *root = NULL;
  vt_status status = vt_parse_json(context, tree->metadata, strlen(tree->metadata), file, &root);
  if (status) return status;
  const vt_json *array = vt_json_member(root, key);
  size_t count = vt_json_is_array(array) ? vt_json_count(array) : 0;
  out->items = VT_NEW(context, char *, count);
  if (!out->items) status = VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    out->items[i] = vt_strdup(context, vt_json_string(vt_json_item(array, i), ""));
    if (!out->items[i])
      status = VT_OUT_OF_MEMORY;
    else
      out->count++;
  }
  vt_free_json(context, root);
  if (status) vt_free_names(context, out);
  return status;
}

bool vt_has_name(const vt_names *names, const char *name) {
  for (int i = 0; i < names->count; i++)
    if (!strcmp(names->items[i], name)) return true;
  return false;
}

vt_status vt_add_metadata(vt_context *context, vt_tree *tree, const char *key, const char *json) {
  size_t length = strlen(tree->metadata);
  while (length > 0 && isspace((unsigned char)tree->metadata[length - 1])) length--;
  if (!length || tree->metadata[length - 1] != '}')
    length = 0; // no object: begin one
  else
    length--;
  size_t last = length;
  while (last > 0 && isspace((unsigned char)tree->metadata[last - 1])) last--;
  bool empty = last == 0 || tree->metadata[last - 1] == '{';
  char *text =
      last == 0 ? vt_print_text(context, "{\"%s\": %s}", key, json)
                : vt_print_text(context, "%.*s%s\"%s\": %s}", (int)last, tree->metadata, empty ? "" : ", ", key, json);
  if (!text) return VT_OUT_OF_MEMORY;
  vt_free(context, tree->metadata);
  tree->metadata = text;
  return VT_OK;
}

static bool cameras_agree(const vt_camera *a, const vt_camera *b, double distance) {
  double turn = 0;
  for (int i = 0; i < 9; i++) turn += fabs(a->rotation.m[i] - b->rotation.m[i]);
  double focal = a->fy / a->height, other = b->fy / b->height; // of any size of the picture
  return vt_length(vt_sub(vt_camera_centre(a), vt_camera_centre(b))) <= distance && turn <= 0.01 &&
         fabs(focal - other) <= 0.01 * focal;
}

vt_status vt_check_same_cameras(vt_context *context, const vt_tree *tree, const char *file, const vt_views *views,
                                const char *source) {
  vt_names names;
  vt_status status = vt_metadata_names(context, tree, file, "views", &names);
  if (status) return status;
  for (int i = 0; i < views->count && !status; i++)
    for (int v = 0; v < names.count && v < tree->view_count; v++) {
      if (strcmp(names.items[v], views->items[i].name)) continue;
      if (!cameras_agree(&tree->cameras[v], &views->items[i].camera, 0.005 * tree->octree.edge))
        status = vt_fail(context, VT_BAD_INPUT,
                         "%s: its camera of %s is not the one that %s was made with; calibrate once "
                         "with voltree capture and give that folder to reconstruct and evaluate",
                         source, views->items[i].name, file);
      break;
    }
  vt_free_names(context, &names);
  return status;
}
