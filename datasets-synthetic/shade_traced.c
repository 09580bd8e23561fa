// shade_traced.c - leaves and bark in sun and sky, by sampled light
// SPDX-License-Identifier: BSD-3-Clause
//
// A surface with albedo A, transmission T (thin ones: leaves) and a specular part shows
//   sun     (A or T) |n.s| E, A on the side that the sun shines on, T on the other, plus the highlight
//           D F G / (4 n.v) pi E of a rough mirror [Walter, Marschner, Li, Torrance 2007, "Microfacet models for
//           refraction": GGX], along one ray to a point of the sun's disc: shadows have edges that widen with distance;
//   sky     A times the mean over the cosine-weighted half space in front, T times that behind (solids: twice in front);
//   sheen   the mirror image of the sky, one ray through the visible normals [Heitz 2018, "Sampling the GGX
//           distribution of visible normals"], whose weight F G_1 is never above 1: no fireflies.
// A ray of the sky or the sheen that is stopped meets the crown's inside: the mean colour of its leaves under a small
// share of sun and sky, reflected and let through. Real leaves hand light on many times; without this they are black.
// The share is chosen by eye: with 0.25 crowns lose their depth.
//
// What goes wrong: (1) rays that start at a surface meet it: they start a step off it, on the side they go to, from a
// point by barycentric coordinates, which lies in the plane to float precision however far the eye is. (2) On coarse
// tubes the facets' own shadow ends in steps where the smooth normal says dusk: sun rays start from a rounded place
// [Hanika 2021, "Hacking the shadow terminator", Ray Tracing Gems II]. (3) A smooth normal may face away from the eye:
// it is bent back.

#include "datasets-synthetic/shade_traced.h"
#include "datasets-synthetic/sky.h"

static const float sun_radius = 0.00465f; // of its disc, radians
static const float smoothest = 0.12f;     // roughness below which the sun's highlight would be noise
static const float inner_share = 0.06f;   // of sun and sky that a leaf inside the crown gets
static const vt_material bark = {.albedo = {1, 1, 1}, .roughness = 1};
static const vt_material leaf = {
    .albedo = {1, 1, 1}, .translucency = {0.62f, 0.66f, 0.3f}, .roughness = 1, .thin = true};

static float dot3(const float a[3], const float b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static void cross3(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}
static bool normalise3(float a[3]) {
  float square = dot3(a, a);
  if (!(square > 1e-30f)) return false;
  float scale = 1 / sqrtf(square);
  for (int k = 0; k < 3; k++) a[k] *= scale;
  return true;
}

// Two directions across n, without a seam but at n = -z (Duff et al. 2017, "Building an orthonormal basis, revisited").
static void make_basis(const float n[3], float s[3], float t[3]) {
  float sign = copysignf(1, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
  s[0] = 1 + sign * n[0] * n[0] * a, s[1] = sign * b, s[2] = -sign * n[0];
  t[0] = b, t[1] = sign + n[1] * n[1] * a, t[2] = -n[1];
}

static void sample_disc(const float random[2], float out[2]) {
  float r = sqrtf(random[0]), angle = 2 * (float)VT_PI * random[1];
  out[0] = r * cosf(angle), out[1] = r * sinf(angle);
}

// ---- materials

static const vt_material *material_of(const vt_mesh *mesh, size_t triangle) {
  if (mesh->material_count) return &mesh->materials[mesh->triangle_materials[triangle]];
  return triangle < mesh->solid_count ? &bark : &leaf;
}

static int wrap(int i, int size) {
  int r = i % size;
  return r < 0 ? r + size : r;
}

// Bilinear, repeated; colours in linear light, weighted by alpha so that what lies in holes does not bleed over their
// rims.
static void sample_texture(const float decode[256], const vt_image *image, float u, float v, float rgba[4]) {
  float x = (u - floorf(u)) * (float)image->width - 0.5f, y = (1 - (v - floorf(v))) * (float)image->height - 0.5f;
  int left = (int)floorf(x), top = (int)floorf(y);
  float fx = x - (float)left, fy = y - (float)top, sum[4] = {0}, flat[3] = {0};
  for (int k = 0; k < 4; k++) {
    int column = wrap(left + (k & 1), image->width), row = wrap(top + (k >> 1), image->height);
    const uint8_t *p = image->pixels + ((size_t)row * (size_t)image->width + (size_t)column) * (size_t)image->channels;
    float weight = (k & 1 ? fx : 1 - fx) * (k >> 1 ? fy : 1 - fy);
    float alpha = image->channels == 4 ? (float)p[3] * (1.0f / 255) : 1;
    for (int c = 0; c < 3; c++) {
      float linear = decode[p[image->channels >= 3 ? c : 0]];
      sum[c] += weight * alpha * linear, flat[c] += weight * linear;
    }
    sum[3] += weight * alpha;
  }
  for (int c = 0; c < 3; c++) rgba[c] = sum[3] > 1e-4f ? sum[c] / sum[3] : flat[c];
  rgba[3] = sum[3];
}

static void place_in_texture(const vt_mesh *mesh, const vt_trace_hit *hit, float uv[2]) {
  const uint32_t *index = mesh->triangles[hit->triangle];
  const float *a = mesh->vertices[index[0]].uv, *b = mesh->vertices[index[1]].uv, *c = mesh->vertices[index[2]].uv;
  for (int k = 0; k < 2; k++) uv[k] = a[k] + hit->u * (b[k] - a[k]) + hit->v * (c[k] - a[k]);
}

static bool is_cut_out(const void *user, uint32_t triangle, float u, float v) {
  const vt_look *look = user;
  const vt_material *material = material_of(look->mesh, triangle);
  if (!(material->cutoff > 0) || !material->texture.pixels || material->texture.channels != 4) return false;
  float uv[2], rgba[4];
  vt_trace_hit hit = {.triangle = triangle, .u = u, .v = v};
  place_in_texture(look->mesh, &hit, uv);
  sample_texture(look->decode, &material->texture, uv[0], uv[1], rgba);
  return rgba[3] < material->cutoff;
}

static bool has_cut_outs(const vt_mesh *mesh) {
  for (int i = 0; i < mesh->material_count; i++)
    if (mesh->materials[i].cutoff > 0 && mesh->materials[i].texture.channels == 4) return true;
  return false;
}

// ---- what all photographs share

// The mean over all leaves, or over the solids where there are none.
static void find_foliage(vt_look *look) {
  const vt_mesh *mesh = look->mesh;
  const float up[3] = {0, 0, 1};
  float sky[3];
  double sums[2][3] = {{0}}, counts[2] = {0, 0};
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const vt_material *material = material_of(mesh, t);
    float uv[2], tint[4] = {1, 1, 1, 1};
    vt_trace_hit middle = {.triangle = (uint32_t)t, .u = 1.0f / 3, .v = 1.0f / 3};
    place_in_texture(mesh, &middle, uv);
    if (material->texture.pixels) sample_texture(look->decode, &material->texture, uv[0], uv[1], tint);
    const float *own = mesh->vertices[mesh->triangles[t][0]].albedo;
    for (int c = 0; c < 3; c++)
      sums[material->thin][c] +=
          (double)(tint[c] * own[c] * material->albedo[c] * (1 + (material->thin ? material->translucency[c] : 0)));
    counts[material->thin]++;
  }
  vt_sky_light(up, sky);
  bool thin = counts[1] > 0;
  for (int c = 0; c < 3; c++)
    look->foliage[c] = (float)(sums[thin][c] / fmax(counts[thin], 1)) * inner_share * (look->sunlight[c] + sky[c]);
}

static vt_status check_mesh(vt_context *ctx, const vt_mesh *mesh) {
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const vt_vertex *p = &mesh->vertices[v];
    float sum = 0; // NaN or infinite if one of them is; 0 * x keeps large ones from adding up to infinity
    for (int k = 0; k < 3; k++) sum += 0 * p->position[k] + 0 * p->normal[k] + 0 * p->albedo[k];
    sum += 0 * p->uv[0] + 0 * p->uv[1];
    if (!(sum == 0))
      return vt_fail(ctx, VT_BAD_INPUT, "mesh: vertex %zu of %zu is no number; repair the model or export it again", v,
                     mesh->vertex_count);
  }
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    for (int k = 0; k < 3; k++) VT_ASSERT(mesh->triangles[t][k] < mesh->vertex_count);
    VT_ASSERT(!mesh->material_count || mesh->triangle_materials[t] < mesh->material_count);
  }
  return VT_OK;
}

vt_status vt_make_look(vt_context *ctx, const vt_mesh *mesh, vt_vec3 sun, vt_look *out) {
  vt_status status = check_mesh(ctx, mesh);
  *out = (vt_look){.mesh = mesh, .sun = {(float)sun.x, (float)sun.y, (float)sun.z}};
  vt_sun_light(out->sunlight);
  for (int i = 0; i < 256; i++) {
    double e = i / 255.0;
    out->decode[i] = (float)(e <= 0.04045 ? e / 12.92 : pow((e + 0.055) / 1.055, 2.4));
  }
  float s[3], t[3], reach = 0;
  make_basis(out->sun, s, t);
  for (int k = 0; k < 3; k++) out->across[k][0] = s[k] * sun_radius, out->across[k][1] = t[k] * sun_radius;
  for (size_t v = 0; v < mesh->vertex_count; v++)
    for (int k = 0; k < 3; k++) reach = fmaxf(reach, fabsf(mesh->vertices[v].position[k]));
  out->step = 8e-6f * reach; // some sixty times the last bit of a coordinate
  if (!status) find_foliage(out);
  return status;
}

vt_status vt_trace_look(vt_context *ctx, const vt_look *look, const vt_vertex *vertices, vt_tracer **out) {
  const vt_mesh *mesh = look->mesh;
  vt_trace_mesh traced = {.vertex_stride = sizeof(vt_vertex),
                          .vertex_count = mesh->vertex_count,
                          .triangle_count = mesh->triangle_count,
                          .is_hole = has_cut_outs(mesh) ? is_cut_out : NULL,
                          .user = look};
  *out = NULL;
  if (mesh->triangle_count) traced.positions = vertices[0].position, traced.triangles = mesh->triangles[0];
  return vt_create_tracer(ctx, &traced, out);
}

// ---- surfaces

static void find_normals(const float e1[3], const float e2[3], const vt_vertex *const corner[3], const float weight[3],
                         const float direction[3], vt_surface *s) {
  cross3(e1, e2, s->flat);
  if (!normalise3(s->flat)) s->flat[0] = -direction[0], s->flat[1] = -direction[1], s->flat[2] = -direction[2];
  for (int k = 0; k < 3; k++) {
    s->normal[k] =
        weight[0] * corner[0]->normal[k] + weight[1] * corner[1]->normal[k] + weight[2] * corner[2]->normal[k];
    s->eye[k] = -direction[k];
  }
  (void)normalise3(s->eye);
  float side = dot3(s->flat, s->eye) < 0 ? -1.0f : 1.0f;
  for (int k = 0; k < 3; k++) s->flat[k] *= side;
  bool smooth = normalise3(s->normal);
  // Wound the wrong way round, as imported meshes may be, a triangle still has a smooth normal on the side that is
  // seen.
  float turn = dot3(s->normal, s->flat) < 0 ? -1.0f : 1.0f;
  for (int k = 0; k < 3; k++) s->normal[k] = smooth ? s->normal[k] * turn : s->flat[k];
  float away = dot3(s->normal, s->eye);
  if (away < 0.02f) {
    for (int k = 0; k < 3; k++) s->normal[k] += (0.02f - away) * s->eye[k];
    (void)normalise3(s->normal);
  }
}

static void round_position(const vt_vertex *const corner[3], const float weight[3], vt_surface *s) {
  for (int k = 0; k < 3; k++) s->rounded[k] = s->position[k];
  for (int i = 0; i < 3 && !s->thin; i++) {
    const float *p = corner[i]->position, *n = corner[i]->normal;
    float side = dot3(n, s->flat) < 0 ? -1.0f : 1.0f;
    float off[3] = {s->position[0] - p[0], s->position[1] - p[1], s->position[2] - p[2]};
    float under = fminf(side * dot3(off, n), 0) * weight[i]; // below the corner's tangent plane
    for (int k = 0; k < 3; k++) s->rounded[k] -= side * under * n[k];
  }
}

void vt_find_surface(const vt_look *look, const vt_vertex *vertices, const float direction[3], const vt_trace_hit *hit,
                     vt_surface *out) {
  const uint32_t *index = look->mesh->triangles[hit->triangle];
  const vt_vertex *const corner[3] = {&vertices[index[0]], &vertices[index[1]], &vertices[index[2]]};
  const float weight[3] = {1 - hit->u - hit->v, hit->u, hit->v};
  const vt_material *material = material_of(look->mesh, hit->triangle);
  float e1[3], e2[3], tint[4] = {1, 1, 1, 1};
  for (int k = 0; k < 3; k++) {
    e1[k] = corner[1]->position[k] - corner[0]->position[k], e2[k] = corner[2]->position[k] - corner[0]->position[k];
    out->position[k] = corner[0]->position[k] + hit->u * e1[k] + hit->v * e2[k];
  }
  find_normals(e1, e2, corner, weight, direction, out);
  out->thin = material->thin;
  round_position(corner, weight, out);
  if (material->texture.pixels) {
    float uv[2];
    place_in_texture(look->mesh, hit, uv);
    sample_texture(look->decode, &material->texture, uv[0], uv[1], tint);
  }
  out->specular = material->specular, out->roughness = material->roughness;
  for (int k = 0; k < 3; k++) {
    float own = weight[0] * corner[0]->albedo[k] + weight[1] * corner[1]->albedo[k] + weight[2] * corner[2]->albedo[k];
    out->albedo[k] = own * material->albedo[k] * tint[k] * (1 - material->specular);
    out->through[k] = out->thin ? out->albedo[k] * material->translucency[k] : 0;
  }
}

// ---- light

// Schlick's, held down where the surface is rough: its grazing facets hide each other (Lagarde 2011).
static float fresnel(const vt_surface *s, float cosine) {
  float c = 1 - fminf(fmaxf(cosine, 0), 1), c2 = c * c;
  return s->specular + (fmaxf(1 - s->roughness, s->specular) - s->specular) * c2 * c2 * c;
}

static float shadowing(float cosine, float alpha) { // Smith's G_1 of GGX
  float c2 = cosine * cosine;
  return 2 * cosine / (cosine + sqrtf(alpha * alpha + (1 - alpha * alpha) * c2) + 1e-20f);
}

static float highlight(const vt_surface *s, const float light[3]) {
  float half[3] = {s->eye[0] + light[0], s->eye[1] + light[1], s->eye[2] + light[2]};
  float nl = dot3(s->normal, light), nv = dot3(s->normal, s->eye);
  if (!(s->specular > 0) || nl <= 0 || nv <= 0 || !normalise3(half)) return 0;
  float rough = fmaxf(s->roughness, smoothest), alpha = rough * rough, nh = dot3(s->normal, half);
  float base = nh * nh * (alpha * alpha - 1) + 1, density = alpha * alpha / (base * base); // pi D
  return density * fresnel(s, dot3(half, light)) * shadowing(nl, alpha) * shadowing(nv, alpha) / (4 * nv);
}

static void start_ray(const vt_look *look, const vt_surface *s, const float from[3], const float direction[3],
                      vt_light_sample *out) {
  float step = dot3(direction, s->flat) < 0 ? -look->step : look->step;
  out->ray = (vt_trace_ray){.far = INFINITY};
  for (int k = 0; k < 3; k++) out->ray.origin[k] = from[k] + step * s->flat[k], out->ray.direction[k] = direction[k];
}

static bool sample_sun(const vt_look *look, const vt_surface *s, const float random[2], vt_light_sample *out) {
  float disc[2], direction[3], cosine = dot3(s->normal, look->sun);
  if (cosine <= 0 && !s->thin) return false;
  sample_disc(random, disc);
  for (int k = 0; k < 3; k++) direction[k] = look->sun[k] + look->across[k][0] * disc[0] + look->across[k][1] * disc[1];
  start_ray(look, s, s->rounded, direction, out);
  const float *share = cosine > 0 ? s->albedo : s->through;
  float shine = highlight(s, look->sun);
  for (int k = 0; k < 3; k++) {
    out->open[k] = look->sunlight[k] * (share[k] * fabsf(cosine) + shine);
    out->stopped[k] = 0;
  }
  return true;
}

static bool sample_sky(const vt_look *look, const vt_surface *s, bool behind, const float random[2],
                       vt_light_sample *out) {
  float disc[2], across[3], along[3], direction[3], light[3], side = behind && s->thin ? -1.0f : 1.0f;
  sample_disc(random, disc);
  make_basis(s->normal, across, along);
  float up = sqrtf(fmaxf(1 - random[0], 0)) * side;
  for (int k = 0; k < 3; k++) direction[k] = across[k] * disc[0] + along[k] * disc[1] + s->normal[k] * up;
  float flat = dot3(direction, s->flat) * side;
  // Where the smooth normal's half space dips below the triangle it is folded back: dark rims otherwise.
  for (int k = 0; k < 3 && flat < 0; k++) direction[k] -= 2 * flat * side * s->flat[k];
  start_ray(look, s, s->position, direction, out);
  vt_sky_light(direction, light);
  const float *share = behind && s->thin ? s->through : s->albedo;
  float part = s->thin ? 1 : 0.5f; // of a solid both rays look in front
  for (int k = 0; k < 3; k++) {
    out->open[k] = part * share[k] * light[k];
    out->stopped[k] = part * share[k] * look->foliage[k];
  }
  return true;
}

static bool sample_sheen(const vt_look *look, const vt_surface *s, const float random[2], vt_light_sample *out) {
  if (!(s->specular > 0)) return false;
  float rough = fmaxf(s->roughness, 0.02f), alpha = rough * rough, across[3], along[3], disc[2];
  make_basis(s->normal, across, along);
  // The eye as seen by a mirror stretched to a hemisphere; a point of its visible half is a normal [Heitz 2018].
  float v[3] = {alpha * dot3(s->eye, across), alpha * dot3(s->eye, along), dot3(s->eye, s->normal)};
  if (!normalise3(v)) return false;
  float t1[3] = {-v[1], v[0], 0}, t2[3], low = 0.5f * (1 + v[2]); // the cut of the visible half wants t1 level
  if (!normalise3(t1)) t1[0] = 1, t1[1] = 0;
  cross3(v, t1, t2);
  sample_disc(random, disc);
  float second = (1 - low) * sqrtf(fmaxf(1 - disc[0] * disc[0], 0)) + low * disc[1];
  float third = sqrtf(fmaxf(1 - disc[0] * disc[0] - second * second, 0));
  float h[3] = {alpha * (disc[0] * t1[0] + second * t2[0] + third * v[0]),
                alpha * (disc[0] * t1[1] + second * t2[1] + third * v[1]),
                fmaxf(disc[0] * t1[2] + second * t2[2] + third * v[2], 1e-6f)};
  if (!normalise3(h)) return false;
  float half[3], direction[3], light[3];
  for (int k = 0; k < 3; k++) half[k] = across[k] * h[0] + along[k] * h[1] + s->normal[k] * h[2];
  float toward = dot3(half, s->eye);
  for (int k = 0; k < 3; k++) direction[k] = 2 * toward * half[k] - s->eye[k];
  float nl = dot3(direction, s->normal);
  if (nl <= 0 || dot3(direction, s->flat) <= 0) return false;
  start_ray(look, s, s->position, direction, out);
  vt_sky_light(direction, light);
  float weight = fresnel(s, toward) * shadowing(nl, alpha);
  for (int k = 0; k < 3; k++) out->open[k] = weight * light[k], out->stopped[k] = weight * look->foliage[k];
  return true;
}

bool vt_sample_light(const vt_look *look, const vt_surface *s, vt_light_part part, const float random[2],
                     vt_light_sample *out) {
  switch (part) {
  case VT_LIGHT_SUN:
    return sample_sun(look, s, random, out);
  case VT_LIGHT_SHEEN:
    return sample_sheen(look, s, random, out);
  default:
    return sample_sky(look, s, part == VT_LIGHT_SKY_BEHIND, random, out);
  }
}
