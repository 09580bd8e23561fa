// mesh_gltf_material.c - materials and textures of glTF files
// SPDX-License-Identifier: BSD-3-Clause
//
// Metal and rough [glTF 2.0, 3.9]: albedo = base colour, linear; reflectance at normal incidence from the index of
// refraction and KHR_materials_specular, ((n - 1) / (n + 1))^2 times both of its factors, 4 % without; the metal part
// is taken no notice of: bark is none, and 1 is the default that exporters forget to change. The older specular and
// glossy kind is read too. Translucency has no word that fits; our own files keep it in `extras`.
//   The first row of a glTF picture is at v = 0, of ours at v = 1. Rows are turned over, not coordinates: 1 - v loses
//   bits. Holes: alphaMode MASK: alpha of texture times factor below alphaCutoff. BLEND: below one half.
#include "datasets-synthetic/mesh_gltf.h"

#include "base/image_file.h"
#include <string.h>

static const vt_json *extension_of(const vt_json *object, const char *name) {
  return vt_json_member(vt_json_member(object, "extensions"), name);
}

static double share(double v) {
  return v >= 0 ? fmin(v, 1) : 0;
}

// ---- factors

static const vt_json *texture_of(const vt_json *material) {
  const vt_json *glossy = extension_of(material, "KHR_materials_pbrSpecularGlossiness");
  return glossy ? vt_json_member(glossy, "diffuseTexture")
                : vt_json_member(vt_json_member(material, "pbrMetallicRoughness"), "baseColorTexture");
}

static double read_colour(const vt_json *material, float albedo[3]) { // returns alpha
  const vt_json *glossy = extension_of(material, "KHR_materials_pbrSpecularGlossiness");
  const vt_json *factor = glossy ? vt_json_member(glossy, "diffuseFactor")
                                 : vt_json_member(vt_json_member(material, "pbrMetallicRoughness"), "baseColorFactor");
  double v[4];
  if (!vt_gltf_numbers(factor, 4, v)) v[0] = v[1] = v[2] = v[3] = 1;
  for (int c = 0; c < 3; c++) albedo[c] = (float)share(v[c]);
  return share(v[3]);
}

static void read_gloss(const vt_json *material, vt_material *out) {
  const vt_json *glossy = extension_of(material, "KHR_materials_pbrSpecularGlossiness");
  double colour[3] = {1, 1, 1}, other[3];
  if (glossy) {
    if (vt_gltf_numbers(vt_json_member(glossy, "specularFactor"), 3, other)) memcpy(colour, other, sizeof colour);
    out->specular = (float)share((colour[0] + colour[1] + colour[2]) / 3);
    out->roughness = (float)share(1 - vt_json_number(vt_json_member(glossy, "glossinessFactor"), 1));
    return;
  }
  const vt_json *rough = vt_json_member(material, "pbrMetallicRoughness");
  const vt_json *specular = extension_of(material, "KHR_materials_specular");
  double n = vt_json_number(vt_json_member(extension_of(material, "KHR_materials_ior"), "ior"), 1.5);
  double reflectance = n == 1.5 ? 0.04 : n > 0 ? (n - 1) * (n - 1) / ((n + 1) * (n + 1)) : 1;
  if (vt_gltf_numbers(vt_json_member(specular, "specularColorFactor"), 3, other)) memcpy(colour, other, sizeof colour);
  double mean = colour[0] == colour[1] && colour[1] == colour[2] ? colour[0] : (colour[0] + colour[1] + colour[2]) / 3;
  double factor = vt_json_number(vt_json_member(specular, "specularFactor"), 1);
  out->specular = (float)(share(reflectance * mean) * share(factor));
  out->roughness = (float)share(vt_json_number(vt_json_member(rough, "roughnessFactor"), 1));
}

static void read_holes(const vt_json *material, double alpha, vt_material *out) {
  const char *mode = vt_json_string(vt_json_member(material, "alphaMode"), "OPAQUE");
  double cutoff = !strcmp(mode, "MASK")    ? vt_json_number(vt_json_member(material, "alphaCutoff"), 0.5)
                  : !strcmp(mode, "BLEND") ? 0.5
                                           : 0;
  if (alpha < 1) cutoff = alpha > 0 ? cutoff / alpha : 1;
  out->cutoff = (float)share(cutoff);
}

static void name_of(const vt_json *material, size_t index, char name[64]) {
  const char *given = vt_json_string(vt_json_member(material, "name"), "");
  if (*given)
    snprintf(name, 64, "%s", given);
  else
    snprintf(name, 64, "material_%zu", index);
}

static vt_status read_material(vt_gltf *gltf, size_t index, vt_material *out, vt_sides *sides, int *uv_set) {
  const vt_json *material = vt_gltf_item(gltf, "materials", index), *extras = vt_json_member(material, "extras");
  const vt_json *texture = texture_of(material);
  size_t set = 0;
  name_of(material, index, out->name);
  double alpha = read_colour(material, out->albedo), translucency[3];
  read_gloss(material, out);
  read_holes(material, alpha, out);
  *sides = vt_json_bool(vt_json_member(material, "doubleSided"), false) ? VT_SIDES_BOTH : VT_SIDES_UNSAID;
  if (vt_json_member(extras, "vt_thin"))
    *sides = vt_json_bool(vt_json_member(extras, "vt_thin"), false) ? VT_SIDES_THIN : VT_SIDES_SOLID;
  if (vt_gltf_numbers(vt_json_member(extras, "vt_translucency"), 3, translucency))
    for (int c = 0; c < 3; c++) out->translucency[c] = (float)fmin(fmax(translucency[c], 0), 1e6);
  if (vt_gltf_whole(texture, "texCoord", 100, &set) < 0)
    return vt_fail_gltf(gltf, "materials", index, "its texCoord is not valid; export it again");
  *uv_set = (int)set;
  if (extension_of(texture, "KHR_texture_transform"))
    vt_log(gltf->ctx, VT_LOG_NORMAL, "%s: materials[%zu]: KHR_texture_transform is not read", gltf->path, index);
  return VT_OK;
}

vt_status vt_gltf_materials(vt_gltf *gltf, vt_mesh *mesh, vt_sides **sides, int **uv_sets) {
  size_t count = vt_json_count(vt_json_member(gltf->json, "materials"));
  vt_status status = VT_OK;
  if (count >= UINT16_MAX) return vt_fail(gltf->ctx, VT_BAD_INPUT, "%s: over 65534 materials; join some", gltf->path);
  mesh->materials = VT_NEW(gltf->ctx, vt_material, count + 1);
  *sides = VT_NEW(gltf->ctx, vt_sides, count + 1);
  *uv_sets = VT_NEW(gltf->ctx, int, count + 1);
  if (!mesh->materials || !*sides || !*uv_sets) return VT_OUT_OF_MEMORY;
  mesh->material_count = (int)count;
  for (size_t i = 0; i < count && !status; i++)
    status = read_material(gltf, i, &mesh->materials[i], &(*sides)[i], &(*uv_sets)[i]);
  vt_fill_plain_material(&mesh->materials[count], false);
  strcpy(mesh->materials[count].name, "default");
  return status;
}

// ---- textures

static void turn_over(vt_image *image) {
  size_t row = (size_t)image->width * (size_t)image->channels;
  for (int top = 0, bottom = image->height - 1; top < bottom; top++, bottom--) {
    uint8_t *a = image->pixels + (size_t)top * row, *b = image->pixels + (size_t)bottom * row;
    for (size_t i = 0; i < row; i++) {
      uint8_t kept = a[i];
      a[i] = b[i], b[i] = kept;
    }
  }
}

static vt_status decode_image(vt_gltf *gltf, size_t index, vt_image *out) {
  const vt_json *image = vt_gltf_item(gltf, "images", index);
  const char *uri = vt_json_string(vt_json_member(image, "uri"), NULL);
  size_t view;
  vt_gltf_bytes bytes = {0};
  uint8_t *owned = NULL;
  vt_status status;
  if (uri) {
    status = vt_gltf_uri(gltf, "images", index, uri, &owned, &bytes.size);
    bytes.bytes = owned;
  } else if (vt_gltf_whole(image, "bufferView", SIZE_MAX, &view) == 1) {
    status = vt_gltf_view(gltf, view, &bytes, NULL);
  } else {
    return vt_fail_gltf(gltf, "images", index, "has neither uri nor bufferView; export it again");
  }
  size_t length = strlen(gltf->path) + 40;
  char *name = status ? NULL : VT_NEW(gltf->ctx, char, length);
  if (!status && !name) status = VT_OUT_OF_MEMORY;
  if (!status) {
    snprintf(name, length, "%s: images[%zu]", gltf->path, index);
    status = vt_decode_image(gltf->ctx, bytes.bytes, bytes.size, name, out);
  }
  vt_free(gltf->ctx, name);
  vt_free(gltf->ctx, owned);
  return status;
}

vt_status vt_gltf_texture(vt_gltf *gltf, size_t index, vt_material *out) {
  const vt_json *info = texture_of(vt_gltf_item(gltf, "materials", index));
  float cutoff = out->cutoff;
  size_t texture_index, source;
  out->cutoff = 0;
  if (!info) return VT_OK;
  if (vt_gltf_whole(info, "index", SIZE_MAX, &texture_index) != 1 || !vt_gltf_item(gltf, "textures", texture_index))
    return vt_fail_gltf(gltf, "materials", index, "its texture is not there; export it again");
  const vt_json *texture = vt_gltf_item(gltf, "textures", texture_index);
  if (vt_gltf_whole(texture, "source", SIZE_MAX, &source) != 1 &&
      vt_gltf_whole(extension_of(texture, "EXT_texture_webp"), "source", SIZE_MAX, &source) != 1)
    return vt_fail_gltf(gltf, "textures", texture_index, "has no PNG, JPEG or WebP picture; export it again");
  vt_status status = decode_image(gltf, source, &out->texture);
  if (!status) status = vt_make_rgba(gltf->ctx, &out->texture);
  if (status) return status;
  turn_over(&out->texture);
  if (cutoff > 0 && vt_has_holes(&out->texture, cutoff)) out->cutoff = cutoff;
  return VT_OK;
}
