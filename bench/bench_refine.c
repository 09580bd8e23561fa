// bench_refine.c - scratch
// SPDX-License-Identifier: BSD-3-Clause
#include "datasets-synthetic/synthetic.h"
#include "reconstruct/refine_cameras.h"
#include <string.h>
static vt_camera *truth;
static int truth_count;
static void measure(const vt_camera *now, vt_vec3 middle, const char *what) {
  vt_similarity s = vt_align_cameras(truth_count, now, truth, middle);
  double turn = 0, shift = 0, px = 0; double f=0;
  for (int i = 0; i < truth_count; i++) {
    vt_camera m = vt_move_camera_by(&s, &now[i]);
    double tr = 0;
    for (int k = 0; k < 9; k++) tr += m.rotation.m[k] * truth[i].rotation.m[k];
    double a = acos(fmin(1, 0.5 * (tr - 1))) * 180 / VT_PI, d = vt_length(vt_sub(vt_camera_centre(&m), vt_camera_centre(&truth[i]))) / vt_length(vt_sub(vt_camera_centre(&truth[i]), middle));
    turn += a * a, shift += d * d;
    for (int k = 0; k < 8; k++) {
      vt_vec3 p = vt_v3(k & 1 ? .5 : -.5, k & 2 ? .5 : -.5, k & 4 ? .5 : -.5);
      double u[2] = {0}, v[2] = {0};
      vt_project(&m, p, u), vt_project(&truth[i], p, v);
      px += ((u[0] - v[0]) * (u[0] - v[0]) + (u[1] - v[1]) * (u[1] - v[1])) / 8;
    }
    f += now[i].fx/truth[i].fx-1;
  }
  printf("  %s: rms %.4f deg, %.4f %% of distance, %.3f px, focal %+.3f %%\n", what, sqrt(turn / truth_count), 100 * sqrt(shift / truth_count), sqrt(px / truth_count), 100*f/truth_count);
}
void vt_hook(vt_refinement *r);
void vt_hook(vt_refinement *r) {
  vt_camera now[1000];
  for (int i = 0; i < r->views.count; i++) now[i] = r->views.items[i].camera;
  measure(now, vt_v3(0, 0, 0), "after");
  if (getenv("POSES")) for (int i = 0; i < r->views.count; i++) printf("   %2d  turn %+.3f %+.3f %+.3f deg  shift %+.3f %+.3f %+.3f %%  el %.2f\n", i, r->pose[i][0]*57.3, r->pose[i][1]*57.3, r->pose[i][2]*57.3, 100*r->pose[i][3], 100*r->pose[i][4], 100*r->pose[i][5], vt_camera_centre(&truth[i]).z);
  if (getenv("GRAD")) for (int i = 0; i < 1; i++) {
    const vt_silhouette *s = &r->silhouettes[i]; int n = s->count; float *e = calloc(n, 4), *e2 = calloc(n, 4), (*J)[VT_SILHOUETTE_COLUMNS] = calloc(n, sizeof *J);
    vt_camera base = s->camera;
    vt_compare_silhouette(r->context, s, &r->volumes[0], &r->response[0], r->smooth[0], &base, r->distance[i], e, J);
    for (int k = 0; k < 7; k++) { double p[6] = {0}, h = 1e-3, xy = 0, xx = 0, yy = 0; if (k < 6) p[k] = h; vt_camera c2 = vt_adjust_camera(&base, p, k == 6 ? h : 0, r->distance[i]);
      vt_compare_silhouette(r->context, s, &r->volumes[0], &r->response[0], r->smooth[0], &c2, r->distance[i], e2, NULL);
      for (int q = 0; q < n; q++) { double f = (e2[q] - e[q]) / h; xy += f * J[q][k], xx += J[q][k] * J[q][k], yy += f * f; }
      printf("  column %d: slope %.3f correlation %.3f size %.3f\n", k, xy / xx, xy / sqrt(xx * yy), sqrt(yy / n)); }
  }
}
int main(int n, char **w) {
  vt_context_desc cd = vt_default_context_desc();
  cd.log_level = getenv("VT_VERBOSE") ? VT_LOG_VERBOSE : VT_LOG_QUIET;
  vt_context *c = vt_create_context(&cd);
  vt_synthetic_desc d = vt_default_synthetic_desc();
  for (int k = 0; k <= VT_SYNTHETIC_CROWN; k++) if (!strcmp(vt_synthetic_name(k), w[1])) d.kind = (vt_synthetic_kind)k;
  d.train_count = n > 3 ? atoi(w[3]) : 32; d.test_count = 0; d.width = d.height = n > 4 ? atoi(w[4]) : 256; d.supersample = 4;
  d.leaf_count = d.kind==VT_SYNTHETIC_TREE?1500:-1; d.rig = n > 5 ? atoi(w[5]) : 0;
  double e = atof(w[2]);
  vt_views v;
  if (vt_make_synthetic_views(c, &d, &v)) return 1;
  printf("fov %.1f, distance %.2f, f %.1f\n", d.fov_y*180/VT_PI, vt_length(vt_camera_centre(&v.items[0].camera)), v.items[0].camera.fx);
  if (getenv("WHITE")) for (int i = 0; i < v.count; i++) for (int k = 0; k < d.width * d.height; k++) for (int q = 0; q < 3; q++) v.items[i].picture.pixels[4 * k + q] = 255;
  truth_count = v.count; truth = calloc(v.count, sizeof *truth);
  for (int i = 0; i < v.count; i++) truth[i] = v.items[i].camera;
  vt_damage_desc dd = vt_default_damage_desc();
  dd.seed = 1; dd.pose_degrees = .2 * e; dd.pose_share = .002 * e; dd.focal_share = n > 6 ? atof(w[6]) : 0;
  if (vt_damage_views(c, &dd, &v)) return 1;
  vt_camera now[1000]; for (int i = 0; i < v.count; i++) now[i] = v.items[i].camera;
  measure(now, vt_v3(0,0,0), "start");
  vt_refine_desc rd = vt_default_refine_desc();
  if (n > 7) for (int i = 0; i < 3; i++) rd.rounds[i] = w[7][i] - '0';
  if (getenv("FD")) rd.focal_deviation = atof(getenv("FD"));
  if (getenv("FOLDS")) rd.fold_count = atoi(getenv("FOLDS"));
  vt_refine_report rep;
  vt_status s = vt_refine_views(c, &rd, &v, &rep);
  if (s) printf("%s\n", vt_last_error(c));
  printf("seconds %.2f\n", rep.seconds);
  vt_free_views(c, &v);
  vt_destroy_context(c);
  return s;
}
