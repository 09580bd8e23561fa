// mesh_obj_write.c - a mesh as an OBJ file with an MTL file and textures beside it
// SPDX-License-Identifier: BSD-3-Clause
//
// tree.obj, tree.mtl, and tree_MATERIAL.png for each texture (.pam in builds that write no PNG). A vertex of ours is
// one v, vt and vn of the file, so all three indices of a corner are the same and triangles stay in their order.
// Numbers have the digits it takes to read the same floats back; colours are encoded (mesh_mtl_read.c says how all
// words are meant), which takes up to 12.
#include "datasets-synthetic/mesh_file.h"

#include "base/file.h"
#include "base/image_file.h"
#include "datasets-synthetic/mesh_text.h"
#include <string.h>

typedef struct out_text { // grows as it is written
  vt_context *ctx;
  char *bytes; // owned; NULL when memory ran out
  size_t size, capacity;
} out_text;

static char *make_room(out_text *out, size_t size) { // NULL: memory ran out, now or before
  if (out->capacity && !out->bytes) return NULL;
  if (size > out->capacity - out->size) {
    size_t capacity = out->capacity * 2 + size + 65536;
    char *bytes = vt_realloc(out->ctx, out->bytes, capacity, 1);
    if (!bytes) vt_free(out->ctx, out->bytes);
    out->bytes = bytes;
    out->capacity = capacity;
    if (!bytes) return NULL;
  }
  return out->bytes + out->size;
}

static void put_text(out_text *out, const char *text) {
  size_t length = strlen(text);
  char *to = make_room(out, length);
  if (!to) return;
  memcpy(to, text, length);
  out->size += length;
}

static void put_floats(out_text *out, const char *word, const float *values, int count, const char *end) {
  put_text(out, word);
  for (int i = 0; i < count; i++) {
    char *to = make_room(out, 40);
    if (!to) return;
    char *begin = to;
    *to++ = ' ';
    to = vt_print_float(to, values[i]);
    out->size += (size_t)(to - begin);
  }
  put_text(out, end);
}

// A linear value so that reading decodes it to the same float.
static void put_encoded(out_text *out, float linear) {
  char *to = make_room(out, 40);
  if (!to) return;
  char *begin = to, *end = to;
  *to++ = ' ';
  for (int digits = 6; digits <= 15; digits += 3) {
    double back;
    end = vt_print_number(to, vt_srgb_from_linear(linear), digits);
    *end = 0;
    if (vt_scan_number(to, &back) && (float)vt_linear_from_srgb(back) == linear) break;
  }
  out->size += (size_t)(end - begin);
}

static void put_encoded_colour(out_text *out, const char *word, const float linear[3], const char *end) {
  put_text(out, word);
  for (int c = 0; c < 3; c++) put_encoded(out, fminf(fmaxf(linear[c], 0), 1));
  put_text(out, end);
}

// ---- materials

// A name without blanks that no other material has; `to` holds 96 bytes.
static void name_material(const vt_mesh *mesh, int m, char *to) {
  const char *name = mesh->materials[m].name;
  bool taken = !*name;
  for (int i = 0; i < mesh->material_count && !taken; i++) taken = i != m && !strcmp(mesh->materials[i].name, name);
  if (taken)
    snprintf(to, 96, "%s_%d", *name ? name : "material", m);
  else
    snprintf(to, 96, "%s", name);
  for (char *p = to; *p; p++)
    if ((unsigned char)*p <= ' ' || *p == '#' || *p == '/' || *p == '\\') *p = '_';
}

static vt_status put_texture(out_text *out, const vt_material *material, const char *name, const char *stem) {
  vt_context *ctx = out->ctx;
  const char *ending = vt_is_output_name("a.png", true) ? "png" : "pam";
  size_t length = strlen(stem) + strlen(name) + 8;
  char *path = VT_NEW(ctx, char, length);
  if (!path) return VT_OUT_OF_MEMORY;
  snprintf(path, length, "%s_%s.%s", stem, name, ending);
  vt_status status = vt_write_image(ctx, path, &material->texture);
  put_text(out, "map_Kd ");
  put_text(out, vt_base_name(path));
  if (material->cutoff > 0) {
    put_text(out, "\nmap_d -imfchan m ");
    put_text(out, vt_base_name(path));
  }
  put_text(out, "\n");
  vt_free(ctx, path);
  return status;
}

static vt_status put_material(out_text *out, const vt_material *material, const char *name, const char *stem) {
  put_text(out, "\nnewmtl ");
  put_text(out, name);
  put_text(out, "\n");
  put_encoded_colour(out, "Kd", material->albedo, "\n");
  char line[160], *to = line;
  double r = material->roughness, ks = material->specular / VT_SPECULAR_OF_KS, back = -1;
  int digits = 5;
  do { // the fewest that read back the same
    *vt_print_number(line, ks, ++digits) = 0;
  } while (digits < 15 && (!vt_scan_number(line, &back) || (float)(back * VT_SPECULAR_OF_KS) != material->specular));
  for (int c = 0; c < 3; c++) {
    to += sprintf(to, c ? " " : "Ks ");
    to = vt_print_number(to, ks, digits);
  }
  to += sprintf(to, "\nNs ");
  to = vt_print_number(to, fmin(2 / fmax(r * r * r * r, 1e-4) - 2, 1000), 4);
  strcpy(to, "\nillum 2\n");
  put_text(out, line);
  put_floats(out, "Pr", &material->roughness, 1, "\n");
  put_text(out, material->thin ? "vt_thin 1\n" : "vt_thin 0\n");
  const float *t = material->translucency;
  if (t[0] != 0 || t[1] != 0 || t[2] != 0) put_floats(out, "vt_translucency", t, 3, "\n");
  if (!material->texture.pixels) return VT_OK;
  if (material->cutoff > 0) put_floats(out, "vt_cutoff", &material->cutoff, 1, "\n");
  return put_texture(out, material, name, stem);
}

static vt_status write_library(vt_context *ctx, const vt_mesh *mesh, const char *stem, const char *path) {
  out_text out = {.ctx = ctx};
  vt_status status = VT_OK;
  put_text(&out, "# voltree " VT_VERSION "; vt_ words are its own\n");
  if (!mesh->material_count)
    for (int thin = 0; thin < 2 && !status; thin++) {
      vt_material plain;
      vt_fill_plain_material(&plain, thin);
      status = put_material(&out, &plain, plain.name, stem);
    }
  for (int m = 0; m < mesh->material_count && !status; m++) {
    char name[96];
    name_material(mesh, m, name);
    status = put_material(&out, &mesh->materials[m], name, stem);
  }
  if (!status && !out.bytes) status = VT_OUT_OF_MEMORY;
  if (!status) status = vt_write_file(ctx, path, out.bytes, out.size);
  vt_free(ctx, out.bytes);
  return status;
}

// ---- geometry

static char *print_index(char *to, uint32_t index) {
  char digits[12];
  int count = 0;
  for (; index || !count; index /= 10) digits[count++] = (char)('0' + index % 10);
  while (count) *to++ = digits[--count];
  return to;
}

static void put_vertices(out_text *out, const vt_mesh *mesh) {
  bool coloured = false;
  for (size_t v = 0; v < mesh->vertex_count && !coloured; v++)
    for (int c = 0; c < 3; c++) coloured |= mesh->vertices[v].albedo[c] != 1;
  size_t begin = 0, end = 0; // the text of the last colour: leaves have one for many vertices
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const vt_vertex *vertex = &mesh->vertices[v];
    float file[3];
    vt_file_from_world(vertex->position, file);
    put_floats(out, "v", file, 3, coloured ? "" : "\n");
    if (!coloured) continue;
    if (v && !memcmp(vertex->albedo, vertex[-1].albedo, sizeof vertex->albedo)) {
      char *to = make_room(out, end - begin);
      if (!to) return;
      memcpy(to, out->bytes + begin, end - begin);
      out->size += end - begin;
    } else {
      begin = out->size;
      put_encoded_colour(out, "", vertex->albedo, "\n");
      end = out->size;
    }
  }
  for (size_t v = 0; v < mesh->vertex_count; v++) put_floats(out, "vt", mesh->vertices[v].uv, 2, "\n");
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    float file[3];
    vt_file_from_world(mesh->vertices[v].normal, file);
    put_floats(out, "vn", file, 3, "\n");
  }
}

static void put_triangle(out_text *out, const uint32_t triangle[3]) {
  char *to = make_room(out, 128);
  if (!to) return;
  char *begin = to;
  *to++ = 'f';
  for (int i = 0; i < 3; i++)
    for (int list = 0; list < 3; list++) {
      *to++ = list ? '/' : ' ';
      to = print_index(to, triangle[i] + 1);
    }
  *to++ = '\n';
  out->size += (size_t)(to - begin);
}

static void put_triangles(out_text *out, const vt_mesh *mesh) {
  int last = -1;
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    int m = mesh->material_count ? mesh->triangle_materials[t] : t >= mesh->solid_count;
    if (m != last) {
      char name[96];
      if (mesh->material_count)
        name_material(mesh, m, name);
      else
        strcpy(name, m ? "sheet" : "solid");
      put_text(out, "usemtl ");
      put_text(out, name);
      put_text(out, "\n");
      last = m;
    }
    put_triangle(out, mesh->triangles[t]);
  }
}

vt_status vt_write_obj(vt_context *ctx, const vt_mesh *mesh, const char *path) {
  out_text out = {.ctx = ctx};
  vt_status status = VT_OUT_OF_MEMORY;
  char *stem = vt_without_ending(ctx, path), *library = NULL;
  if (!stem) goto done;
  library = VT_NEW(ctx, char, strlen(stem) + 5);
  if (!library) goto done;
  sprintf(library, "%s.mtl", stem);
  put_text(&out, "# voltree " VT_VERSION "; y up\nmtllib ");
  put_text(&out, vt_base_name(library));
  put_text(&out, "\n");
  put_vertices(&out, mesh);
  put_triangles(&out, mesh);
  if (!out.bytes) goto done;
  status = write_library(ctx, mesh, stem, library);
  if (!status) status = vt_write_file(ctx, path, out.bytes, out.size);
done:
  vt_free(ctx, out.bytes);
  vt_free(ctx, stem);
  vt_free(ctx, library);
  return status;
}
