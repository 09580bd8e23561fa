// least_squares_ceres.cc - non-linear least squares with bounds and a robust loss, by Ceres
// SPDX-License-Identifier: BSD-3-Clause
//
// Levenberg-Marquardt with a sparse Cholesky of the normal equations where Ceres has one, else with a dense one; bounds by
// projection and a line search. Where groups are to be eliminated, the same of the Schur complement. A start outside its bounds is
// refused here, since Ceres would say so only in its log.

#include "base/least_squares.h"

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <ceres/ceres.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
#include <algorithm>
#include <cmath>
#include <new>
#include <vector>

extern "C" vt_least_squares_desc vt_default_least_squares_desc(void) {
  vt_least_squares_desc desc = {};
  desc.cookie = VT_COOKIE;
  desc.iterations = 100;
  desc.function_tolerance = 1e-10;
  desc.gradient_tolerance = 1e-12;
  desc.parameter_tolerance = 1e-10;
  desc.thread_count = 1;
  desc.loss = VT_LOSS_NONE;
  desc.loss_width = 1;
  return desc;
}

extern "C" bool vt_can_solve_least_squares(void) {
  return true;
}

namespace {

class block_cost : public ceres::CostFunction {
 public:
  block_cost(const vt_residual_block &block, const vt_parameter_group *groups) : block_(block) {
    set_num_residuals(block.residual_count);
    for (int k = 0; k < block.group_count; k++) mutable_parameter_block_sizes()->push_back(groups[block.groups[k]].size);
  }
  bool Evaluate(double const *const *parameters, double *residuals, double **jacobians) const override {
    return block_.evaluate(block_.user, parameters, residuals, jacobians);
  }

 private:
  const vt_residual_block block_;
};

// Ceres orders what it eliminates by address: the values of all groups stand one behind the other, or memory would have a say.
std::vector<double> stage_values(int count, const vt_parameter_group *groups, std::vector<vt_parameter_group> *staged) {
  std::vector<double> values;
  for (int g = 0; g < count; g++) {
    VT_ASSERT(groups[g].size >= 1 && groups[g].values);
    values.insert(values.end(), groups[g].values, groups[g].values + groups[g].size);
  }
  staged->assign(groups, groups + count);
  size_t at = 0;
  for (vt_parameter_group &group : *staged) {
    group.values = values.data() + at;
    at += static_cast<size_t>(group.size);
  }
  return values; // moved: the addresses stay
}

vt_status add_groups(vt_context *context, const char *name, int count, const vt_parameter_group *groups,
                     ceres::Problem *problem) {
  for (int g = 0; g < count; g++) {
    const vt_parameter_group &group = groups[g];
    problem->AddParameterBlock(group.values, group.size);
    for (int i = 0; i < group.size; i++) {
      const double v = group.values[i];
      if (!std::isfinite(v) || (group.least && !(v >= group.least[i])) || (group.most && !(v <= group.most[i])))
        return vt_fail(context, VT_BAD_INPUT, "%s: parameter %d of group %d starts at %g, outside its bounds; start within them",
                       name, i, g, v);
      if (group.least) problem->SetParameterLowerBound(group.values, i, group.least[i]);
      if (group.most) problem->SetParameterUpperBound(group.values, i, group.most[i]);
    }
    if (group.constant) problem->SetParameterBlockConstant(group.values);
  }
  return VT_OK;
}

void add_blocks(const vt_least_squares_desc *desc, const vt_parameter_group *groups, int count,
                const vt_residual_block *blocks, ceres::LossFunction *huber, ceres::Problem *problem) {
  for (int b = 0; b < count; b++) {
    VT_ASSERT(blocks[b].residual_count >= 1 && blocks[b].group_count >= 1);
    std::vector<double *> values;
    for (int k = 0; k < blocks[b].group_count; k++) values.push_back(groups[blocks[b].groups[k]].values);
    problem->AddResidualBlock(new block_cost(blocks[b], groups), desc->loss == VT_LOSS_HUBER ? huber : nullptr, values);
  }
}

ceres::Solver::Options options_of(const vt_least_squares_desc *desc, int group_count, const vt_parameter_group *groups) {
  ceres::Solver::Options options;
  bool eliminates = false;
  for (int g = 0; g < group_count; g++) eliminates = eliminates || groups[g].eliminated;
  options.max_num_iterations = desc->iterations;
  options.function_tolerance = desc->function_tolerance;
  options.gradient_tolerance = desc->gradient_tolerance;
  options.parameter_tolerance = desc->parameter_tolerance;
  options.num_threads = desc->thread_count;
  options.logging_type = ceres::SILENT;
  options.linear_solver_type = eliminates ? ceres::SPARSE_SCHUR : ceres::SPARSE_NORMAL_CHOLESKY;
  std::string error;
  if (!options.IsValid(&error)) options.linear_solver_type = eliminates ? ceres::DENSE_SCHUR : ceres::DENSE_NORMAL_CHOLESKY;
  if (eliminates) {
    options.linear_solver_ordering.reset(new ceres::ParameterBlockOrdering);
    for (int g = 0; g < group_count; g++)
      options.linear_solver_ordering->AddElementToGroup(groups[g].values, groups[g].eliminated ? 0 : 1);
  }
  return options;
}

vt_status solve(vt_context *context, const vt_least_squares_desc *desc, const char *name, int group_count,
                const vt_parameter_group *own_groups, int block_count, const vt_residual_block *blocks,
                vt_least_squares_report *report) {
  std::vector<vt_parameter_group> staged;
  std::vector<double> values = stage_values(group_count, own_groups, &staged);
  const vt_parameter_group *groups = staged.data();
  ceres::HuberLoss huber(desc->loss_width);
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  vt_status status = add_groups(context, name, group_count, groups, &problem);
  if (status) return status;
  add_blocks(desc, groups, block_count, blocks, &huber, &problem);
  double cost = 0;
  if (!problem.Evaluate(ceres::Problem::EvaluateOptions(), &cost, nullptr, nullptr, nullptr) || !std::isfinite(cost))
    return vt_fail(context, VT_BAD_INPUT, "%s: its residuals cannot be computed at the start; start elsewhere", name);
  ceres::Solver::Summary summary;
  ceres::Solve(options_of(desc, group_count, groups), &problem, &summary);
  for (int g = 0; g < group_count; g++) std::copy(groups[g].values, groups[g].values + groups[g].size, own_groups[g].values);
  report->initial_cost = summary.initial_cost;
  report->final_cost = summary.final_cost;
  report->iterations = static_cast<int>(summary.iterations.size()) - 1; // the first is the start
  report->converged = summary.termination_type == ceres::CONVERGENCE;
  if (!summary.IsSolutionUsable())
    return vt_fail(context, VT_FAILED, "%s: no step lowers its residuals (%s); start elsewhere", name, summary.message.c_str());
  return VT_OK;
}

} // namespace

extern "C" vt_status vt_solve_least_squares(vt_context *context, const vt_least_squares_desc *desc, const char *name,
                                            int group_count, const vt_parameter_group *groups, int block_count,
                                            const vt_residual_block *blocks, vt_least_squares_report *or_null) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->iterations >= 0 && desc->thread_count >= 1 && desc->loss_width > 0);
  vt_least_squares_report report = {};
  vt_status status = VT_OK;
  try {
    status = solve(context, desc, name, group_count, groups, block_count, blocks, &report);
  } catch (const std::bad_alloc &) {
    status = vt_fail(context, VT_OUT_OF_MEMORY, "%s: no memory for its least squares; make it smaller", name);
  } catch (const std::exception &e) {
    status = vt_fail(context, VT_FAILED, "%s: least squares failed: %s", name, e.what());
  }
  if (or_null) *or_null = report;
  return status;
}
