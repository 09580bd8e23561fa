// marks.c - the scale of the world from points that somebody marked in the photographs
// SPDX-License-Identifier: BSD-3-Clause
//
// A text file, a mark or a distance a line, pixels as a viewer shows them, upright:
//   a.jpg 1023.5 877 foot
//   "b 2.jpg" 940 801 foot
//   distance foot top 2.35
// Each point must be marked from two sides or more (points.c). Marks of one point that do not agree within a hundredth of the
// picture, or distances that contradict each other, are a slip that has to be told.

#include "base/file.h"
#include "capture/world.h"

#include <stdlib.h>
#include <string.h>

typedef struct mark {
  char *name; // owned
  vt_sighting *sightings; // owned
  int *lines; // owned
  int count;
  vt_point point;
} mark;

typedef struct marks {
  vt_context *context;
  const vt_photos *photos;
  const char *path;
  int line;
  mark *items;
  int count;
  struct { int a, b, line; double metres; } distances[256];
  int distance_count;
} marks;

// The next word, or what stands in quotes; cut out of the line. NULL if there is none.
static char *take_word(char **text) {
  char *at = *text + strspn(*text, " \t\r,"), stop = ' ';
  if (!*at || *at == '#') return NULL;
  if (*at == '"') stop = *at++;
  char *end = at;
  while (*end && (stop == '"' ? *end != '"' : !strchr(" \t\r,", *end))) end++;
  *text = *end ? end + 1 : end;
  *end = 0;
  return at;
}

static bool take_number(char **text, double *out) {
  char *word = take_word(text), *end = NULL;
  if (word) *out = strtod(word, &end);
  return word && end != word && !*end && isfinite(*out);
}

static vt_status wrong_line(marks *m, const char *what) {
  return vt_fail(m->context, VT_BAD_INPUT,
                 "%s: line %d: %s; a line is: PHOTOGRAPH X Y NAME (pixels), or: distance NAME NAME METRES", m->path, m->line, what);
}

// The number of the mark of that name; made if it is not there and `make`. < 0: not there, or without memory.
static int mark_number(marks *m, const char *name, bool make) {
  for (int i = 0; i < m->count; i++)
    if (!strcmp(m->items[i].name, name)) return i;
  if (!make) return -1;
  mark *bigger = vt_realloc(m->context, m->items, (size_t)m->count + 1, sizeof *bigger);
  if (!bigger) return -1;
  m->items = bigger;
  m->items[m->count] = (mark){.name = vt_strdup(m->context, name)};
  return m->items[m->count].name ? m->count++ : -1;
}

// The photograph of that name: as it is called, or the end of that behind a slash, if only one ends so. -1: none; -2: several.
static int photo_number(const vt_photos *photos, const char *name) {
  int found = -1;
  size_t length = strlen(name);
  for (int i = 0; i < photos->count; i++) {
    const char *own = photos->items[i].name;
    size_t n = strlen(own);
    if (!strcmp(own, name)) return i;
    if (n > length && own[n - length - 1] == '/' && !strcmp(own + n - length, name)) found = found == -1 ? i : -2;
  }
  return found;
}

// A point of the picture as its EXIF header turns it, on the picture as it is stored.
static void turn_back(const vt_photo *photo, double pixel[2]) {
  double u = pixel[0], v = pixel[1], w = photo->width, h = photo->height;
  switch (photo->upright) {
  case 2: pixel[0] = w - u; break;
  case 3: pixel[0] = w - u, pixel[1] = h - v; break;
  case 4: pixel[1] = h - v; break;
  case 5: pixel[0] = v, pixel[1] = u; break;
  case 6: pixel[0] = v, pixel[1] = h - u; break;
  case 7: pixel[0] = w - v, pixel[1] = h - u; break;
  case 8: pixel[0] = w - v, pixel[1] = u; break;
  default: break;
  }
}

static vt_status add_mark(marks *m, const char *photograph, double pixel[2], const char *name) {
  int photo = photo_number(m->photos, photograph), number;
  if (photo == -1)
    return vt_fail(m->context, VT_BAD_INPUT, "%s: line %d: no photograph with a camera is called %s; correct the name", m->path,
                   m->line, photograph);
  if (photo < 0)
    return vt_fail(m->context, VT_BAD_INPUT, "%s: line %d: several photographs are called %s; give the folder too", m->path,
                   m->line, photograph);
  const vt_photo *p = &m->photos->items[photo];
  bool turned = p->upright > 4;
  int width = turned ? p->height : p->width, height = turned ? p->width : p->height;
  if (pixel[0] < 0 || pixel[1] < 0 || pixel[0] > width || pixel[1] > height)
    return vt_fail(m->context, VT_BAD_INPUT, "%s: line %d: (%g, %g) is not in %s, which has %d x %d pixels; correct the mark",
                   m->path, m->line, pixel[0], pixel[1], photograph, width, height);
  turn_back(p, pixel);
  number = mark_number(m, name, true);
  if (number < 0) return VT_OUT_OF_MEMORY;
  mark *one = &m->items[number];
  vt_sighting *bigger = vt_realloc(m->context, one->sightings, (size_t)one->count + 1, sizeof *bigger);
  if (!bigger) return VT_OUT_OF_MEMORY;
  one->sightings = bigger;
  int *lines = vt_realloc(m->context, one->lines, (size_t)one->count + 1, sizeof *lines);
  if (!lines) return VT_OUT_OF_MEMORY;
  one->lines = lines;
  one->lines[one->count] = m->line;
  one->sightings[one->count++] = (vt_sighting){photo, {pixel[0], pixel[1]}};
  return VT_OK;
}

static vt_status read_line(marks *m, char *text) {
  char *word = take_word(&text), *name, *other;
  double pixel[2], metres;
  if (!word) return VT_OK;
  if (strcmp(word, "distance")) {
    if (!take_number(&text, &pixel[0]) || !take_number(&text, &pixel[1]) || !(name = take_word(&text)))
      return wrong_line(m, "it has no two numbers and a name behind the photograph");
    return add_mark(m, word, pixel, name);
  }
  name = take_word(&text), other = name ? take_word(&text) : NULL;
  if (!other || !take_number(&text, &metres) || !(metres > 0)) return wrong_line(m, "it has no two names and metres above 0");
  if (m->distance_count == (int)(sizeof m->distances / sizeof m->distances[0])) return wrong_line(m, "over 256 distances");
  int a = mark_number(m, name, true), b = mark_number(m, other, true);
  if (a < 0 || b < 0) return VT_OUT_OF_MEMORY;
  if (a == b) return wrong_line(m, "the distance of a mark from itself");
  m->distances[m->distance_count].a = a, m->distances[m->distance_count].b = b;
  m->distances[m->distance_count].line = m->line;
  m->distances[m->distance_count++].metres = metres;
  return VT_OK;
}

static vt_status find_mark(marks *m, mark *one) {
  if (one->count < 2)
    return vt_fail(m->context, VT_BAD_INPUT,
                   "%s: %s is marked in %d photograph%s; mark it in two or more, from different sides", m->path, one->name,
                   one->count, one->count == 1 ? "" : "s");
  bool found = vt_triangulate(m->photos, one->sightings, one->count, &one->point);
  if (!found || one->point.angle < VT_LEAST_ANGLE)
    return vt_fail(m->context, VT_BAD_INPUT,
                   "%s: %s is marked from one side only, so its place is not known; mark it in photographs from different sides",
                   m->path, one->name);
  const vt_photo *photo = &m->photos->items[one->sightings[one->point.worst_sighting].photo];
  double longer = photo->width > photo->height ? photo->width : photo->height;
  if (one->point.worst > fmax(3, 0.01 * longer))
    return vt_fail(m->context, VT_BAD_INPUT,
                   "%s: line %d: %s in %s is %.0f pixels from where the other marks put it; look at this one, or the others of "
                   "that name",
                   m->path, one->lines[one->point.worst_sighting], one->name, photo->name, one->point.worst);
  vt_log(m->context, VT_LOG_NORMAL, "mark %s: in %d photographs, %.2f pixels", one->name, one->count, one->point.rms);
  return VT_OK;
}

static vt_status scale_of_marks(marks *m, double *metres_per_unit) {
  vt_span spans[256];
  vt_status status = VT_OK;
  double spread = 0;
  if (!m->distance_count)
    return vt_fail(m->context, VT_BAD_INPUT, "%s: no distance in it; add a line: distance NAME NAME METRES", m->path);
  for (int i = 0; i < m->distance_count && !status; i++) {
    mark *ends[2] = {&m->items[m->distances[i].a], &m->items[m->distances[i].b]};
    for (int k = 0; k < 2 && !status; k++)
      if (!(ends[k]->point.angle > 0)) status = find_mark(m, ends[k]);
    if (status) return status;
    spans[i] = (vt_span){vt_length(vt_sub(ends[0]->point.place, ends[1]->point.place)), m->distances[i].metres};
    if (!(spans[i].units > 0))
      return vt_fail(m->context, VT_BAD_INPUT, "%s: line %d: both marks are at one place; mark two points", m->path,
                     m->distances[i].line);
  }
  *metres_per_unit = vt_scale_of_spans(spans, m->distance_count, &spread);
  double least = spans[0].metres / spans[0].units, most = spans[m->distance_count - 1].metres / spans[m->distance_count - 1].units;
  if (most > 1.2 * least)
    return vt_fail(m->context, VT_BAD_INPUT,
                   "%s: the distances contradict each other, a unit is %.4g metres by one and %.4g by another; measure again",
                   m->path, least, most);
  vt_log(m->context, VT_LOG_NORMAL, "scale: a unit is %.6g metres, by %d distance%s, which differ by %.2f %%", *metres_per_unit,
         m->distance_count, m->distance_count == 1 ? "" : "s", 100 * (most / least - 1));
  return VT_OK;
}

vt_status vt_scale_by_marks(vt_context *context, const char *path, const vt_photos *photos, double *metres_per_unit) {
  marks *m = VT_NEW(context, marks, 1);
  if (!m) return VT_OUT_OF_MEMORY;
  uint8_t *bytes = NULL;
  size_t size = 0;
  *m = (marks){.context = context, .photos = photos, .path = path};
  vt_status status = vt_read_file(context, path, &bytes, &size);
  for (char *line = (char *)bytes, *next; !status && line && *line; line = next) {
    size_t length = strcspn(line, "\n");
    next = line + length + (line[length] == '\n');
    line[length] = 0;
    m->line++;
    status = read_line(m, line);
  }
  if (!status) status = scale_of_marks(m, metres_per_unit);
  for (int i = 0; i < m->count; i++) {
    vt_free(context, m->items[i].name);
    vt_free(context, m->items[i].sightings);
    vt_free(context, m->items[i].lines);
  }
  vt_free(context, m->items);
  vt_free(context, bytes);
  vt_free(context, m);
  return status;
}
