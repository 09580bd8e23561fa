// synthetic_cases.h - small synthetic captures and meshes that tests share
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_SYNTHETIC_CASES_H
#define VT_TESTS_SYNTHETIC_CASES_H

#include "datasets-synthetic/mesh.h"
#include "datasets-synthetic/synthetic.h"
#include "tests/unit.h"

static inline vt_context *make_context(int threads, uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.max_memory = max_memory, desc.log_level = VT_LOG_QUIET;
  vt_context *ctx = vt_create_context(&desc);
  assert_non_null(ctx);
  return ctx;
}

static inline vt_synthetic_desc small_desc(void) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.train_count = 3, desc.test_count = 1, desc.width = 72, desc.height = 64, desc.supersample = 3;
  desc.leaf_count = 800, desc.light_path = VT_RAY_TRACED;
  return desc;
}

static inline vt_views photograph(vt_context *ctx, const vt_synthetic_desc *desc) {
  vt_views views;
  vt_status status = vt_make_synthetic_views(ctx, desc, &views);
  if (status) printf("%s\n", vt_last_error(ctx));
  assert_int_equal(status, VT_OK);
  return views;
}

static inline void add_quad(vt_context *ctx, vt_mesh *mesh, vt_vec3 centre, vt_vec3 u, vt_vec3 v) {
  assert_int_equal(vt_reserve_mesh(ctx, mesh, 4, 2), VT_OK);
  vt_vec3 normal = vt_normalise(vt_cross(u, v)), green = {0.07, 0.15, 0.03};
  uint32_t first = (uint32_t)mesh->vertex_count;
  for (int k = 0; k < 4; k++) {
    double x = k == 1 || k == 2 ? 1 : -1, y = k >= 2 ? 1 : -1;
    uint32_t at = vt_add_vertex(mesh, vt_add(centre, vt_add(vt_scale(u, x), vt_scale(v, y))), normal, green);
    mesh->vertices[at].uv[0] = (float)(0.5 + 0.5 * x), mesh->vertices[at].uv[1] = (float)(0.5 + 0.5 * y);
  }
  vt_add_triangle(mesh, first, first + 1, first + 2);
  vt_add_triangle(mesh, first, first + 2, first + 3);
}

#endif
