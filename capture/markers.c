// markers.c - the scale of the world from square markers of known size in the photographs
// SPDX-License-Identifier: BSD-3-Clause
//
// ArUco markers [Garrido-Jurado et al. 2014], found by OpenCV: each has four corners, which are points (points.c), and four
// sides of one length. A marker that does not agree with itself between photographs (it was moved, or read wrongly) is left out.

#include "capture/vision.h"
#include "capture/world.h"

#define MARKER_RMS 3.0 // pixels

typedef struct found { // in one photograph
  vt_marker *items; // owned
  int count;
  vt_status status;
} found;

typedef struct search {
  vt_context *context;
  const vt_photos *photos;
  int cells;
  found *each; // [photographs]
} search;

static vt_status search_one(search *s, size_t i) {
  vt_image picture = {0}, grey = {0};
  vt_marker *all = VT_NEW(s->context, vt_marker, VT_MAX_MARKERS);
  int count = 0;
  vt_status status = all ? vt_read_photo(s->context, &s->photos->items[i], &picture) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_make_image(s->context, picture.width, picture.height, 1, &grey);
  for (size_t k = 0; !status && k < (size_t)grey.width * (size_t)grey.height; k++) {
    const uint8_t *p = picture.pixels + (size_t)picture.channels * k;
    grey.pixels[k] = (uint8_t)((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) >> 8);
  }
  if (!status) status = vt_find_markers(s->context, &grey, s->cells, all, &count);
  if (!status) {
    s->each[i].items = vt_realloc(s->context, all, (size_t)count, sizeof *all);
    s->each[i].count = s->each[i].items ? count : 0;
    if (s->each[i].items) all = NULL;
  }
  vt_free(s->context, all);
  vt_free_image(s->context, &picture);
  vt_free_image(s->context, &grey);
  return status;
}

static void search_block(void *user, size_t begin, size_t end, int worker) {
  search *s = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) s->each[i].status = search_one(s, i);
}

// The four sides of the marker `id`, if it is seen well in two photographs or more; how many were added to spans.
static int add_marker(const search *s, int id, vt_sighting *sightings, double metres, vt_span *spans) {
  vt_vec3 corners[4];
  for (int c = 0; c < 4; c++) {
    int count = 0;
    vt_point point;
    for (int i = 0; i < s->photos->count; i++)
      for (int k = 0; k < s->each[i].count; k++) {
        const vt_marker *marker = &s->each[i].items[k];
        if (marker->id != id || (k && marker[-1].id == id)) continue;
        sightings[count++] = (vt_sighting){i, {marker->corners[c][0], marker->corners[c][1]}};
      }
    if (!vt_triangulate(s->photos, sightings, count, &point) || point.angle < VT_LEAST_ANGLE || point.rms > MARKER_RMS) return 0;
    corners[c] = point.place;
  }
  for (int c = 0; c < 4; c++) spans[c] = (vt_span){vt_length(vt_sub(corners[c], corners[(c + 1) % 4])), metres};
  return 4;
}

static vt_status scale_of_markers(const search *s, double metres, double *metres_per_unit) {
  enum { IDS = 1000 };
  vt_sighting *sightings = VT_NEW(s->context, vt_sighting, (size_t)s->photos->count);
  vt_span *spans = VT_NEW(s->context, vt_span, 4 * IDS);
  int seen[IDS] = {0}, photographs = 0, markers = 0, count = 0;
  vt_status status = sightings && spans ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < s->photos->count; i++) {
    photographs += s->each[i].count > 0;
    for (int k = 0; k < s->each[i].count; k++)
      if (s->each[i].items[k].id >= 0 && s->each[i].items[k].id < IDS) seen[s->each[i].items[k].id]++;
  }
  for (int id = 0; id < IDS && !status; id++) {
    int added = seen[id] > 1 ? add_marker(s, id, sightings, metres, spans + count) : 0;
    count += added;
    markers += added > 0;
    if (seen[id] > 1 && !added)
      vt_log(s->context, VT_LOG_NORMAL, "marker %d: its %d photographs do not agree where it is; left out", id, seen[id]);
  }
  double spread = 0;
  if (!status && !count)
    status = vt_fail(s->context, VT_BAD_INPUT,
                     "markers: none of %d x %d cells was found at one place in two photographs (in %d of %d there are some); "
                     "is --marker-cells right? Else lay larger ones, or give the scale by --marks or --height",
                     s->cells, s->cells, photographs, s->photos->count);
  if (!status) {
    *metres_per_unit = vt_scale_of_spans(spans, count, &spread);
    vt_log(s->context, VT_LOG_NORMAL, "scale: a unit is %.6g metres, by %d marker%s in %d photographs, to about %.2f %%",
           *metres_per_unit, markers, markers == 1 ? "" : "s", photographs, 100 * spread);
  }
  vt_free(s->context, sightings);
  vt_free(s->context, spans);
  return status;
}

vt_status vt_scale_by_markers(vt_context *context, double metres, int cells, const vt_photos *photos, double *metres_per_unit) {
  size_t count = (size_t)photos->count;
  search s = {context, photos, cells, VT_NEW(context, found, count)};
  vt_status status = s.each ? vt_parallel(context, count, 1, search_block, &s) : VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count && !status; i++) {
    if (!s.each[i].status) continue;
    vt_clear_error(context); // of several bad files the first is the one in the sentence
    status = search_one(&s, i);
  }
  if (!status) status = scale_of_markers(&s, metres, metres_per_unit);
  for (size_t i = 0; i < count && s.each; i++) vt_free(context, s.each[i].items);
  vt_free(context, s.each);
  return status;
}
