// tree.c - a grown tree as a mesh: wood, bark, leaves and what they are made of
// SPDX-License-Identifier: BSD-3-Clause

#include "datasets-synthetic/tree.h"
#include "datasets-synthetic/bark.h"
#include "datasets-synthetic/leaves.h"
#include "datasets-synthetic/paint.h"

// Without textures, translucency and shine (rasterised pictures) materials change nothing: the vertices' albedo is the mean.
static vt_status make_materials(vt_context *ctx, const vt_habit *habit, uint32_t seed, vt_mesh *mesh) {
  const vt_foliage *foliage = &habit->foliage;
  vt_leaf_form form = vt_form_of_seed(foliage, seed);
  mesh->materials = VT_NEW(ctx, vt_material, VT_TREE_MATERIALS);
  if (!mesh->materials) return VT_OUT_OF_MEMORY;
  mesh->material_count = VT_TREE_MATERIALS;
  vt_material *bark = &mesh->materials[VT_TREE_BARK], *twig = &mesh->materials[VT_TREE_TWIG];
  vt_material *leaf = &mesh->materials[VT_TREE_LEAF];
  *bark = (vt_material){.name = "bark", .specular = 0.03f, .roughness = 0.9f};
  *twig = (vt_material){.name = "twig", .albedo = {1, 1, 1}, .specular = 0.04f, .roughness = 0.7f};
  *leaf = (vt_material){.thin = true, .specular = foliage->specular, .roughness = foliage->roughness};
  snprintf(leaf->name, sizeof leaf->name, "%s", form == VT_LEAF_NEEDLES ? "needle" : "leaf");
  for (int c = 0; c < 3; c++) leaf->translucency[c] = foliage->translucency[c];
  vt_status status = vt_paint_bark(ctx, habit->pattern, seed, bark);
  return status ? status : vt_paint_leaf(ctx, form, seed, leaf);
}

vt_status vt_grow_tree(vt_context *ctx, vt_synthetic_kind kind, uint32_t seed, int leaf_count, vt_mesh *mesh) {
  const vt_habit *habit = vt_habit_of(kind);
  vt_skeleton skeleton = {0};
  if (leaf_count < 0) leaf_count = habit->foliage.own_count;
  vt_status status = vt_grow_skeleton(ctx, habit, seed, &skeleton);
  if (!status) status = make_materials(ctx, habit, seed, mesh);
  if (!status) status = vt_add_bark(ctx, habit, &skeleton, seed, VT_TREE_BARK, mesh);
  if (!status) status = vt_add_leaves(ctx, &habit->foliage, &skeleton, seed, leaf_count, VT_TREE_LEAF, mesh);
  if (!status) vt_centre_mesh(mesh, 2);
  vt_free_skeleton(ctx, &skeleton);
  return status;
}
