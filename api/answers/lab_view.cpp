// Responses of the laboratory, and its list of experiments.

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/lab.h"

namespace api {
namespace {

namespace lab = core::lab;

Json optional_json(const std::optional<double>& value) {
  return value ? number_json(*value) : Json(nullptr);
}

Json parameters_json(const lab::Setup& setup) {
  Json object = Json::object();
  for (std::size_t i = 0; i < setup.parameters.size(); ++i) {
    object[std::string(setup.experiment->parameters[i].name)] = number_json(setup.parameters[i]);
  }
  return object;
}

Json pattern_json(const LabOutcomeView& view) {
  Json pattern = Json::array();
  for (const core::Vec4& p : view.outcome.pattern) {
    Json point = {number_json(p.x), number_json(p.y)};
    if (view.request.setup.experiment->pattern_dimensions > 2) {
      point.push_back(number_json(p.z));
      point.push_back(number_json(p.w));
    }
    pattern.push_back(std::move(point));
  }
  return pattern;
}

const View<lab::Point>& lab_point_view() {
  using lab::Point;
  static const View<Point> kView = {
      "LabPoint",
      "Results for one n.",
      {{"n", shape::count("Samples per trial, after rounding."), Member<&Point::n>::json},
       {"n_asked", shape::count("The requested n, before rounding."),
        Member<&Point::n_asked>::json},
       {"mean", shape::real("Mean of the replicates."), Member<&Point::mean>::number},
       {"rmse", shape::real("Root mean square error of the replicates."),
        Member<&Point::rmse>::number},
       {"standard_error", shape::real("Standard error of the mean."),
        Member<&Point::standard_error>::number},
       {"cost", shape::real("Mean work of a replicate; n unless the experiment counts it."),
        Member<&Point::cost>::number},
       {"seconds",
        shape::real("CPU time of all replicates. It is measured and differs from run to run; all "
                    "other members are reproducible."),
        Member<&Point::seconds>::number}}};
  return kView;
}

const View<LabOutcomeView>& lab_outcome_view() {
  using Out = LabOutcomeView;
  static const View<Out> kView = {
      "LabOutcome",
      "The outcome; last line of the response.",
      {{"expected", shape::real("Exact value, from a formula."),
        [](const Out& o) { return number_json(o.outcome.expected); }},
       {"slope",
        shape::nullable(shape::real("Slope of log RMSE over log n, by least squares; null with "
                                    "fewer than two n, or without an error.")),
        [](const Out& o) { return optional_json(o.outcome.slope); }},
       {"slope_interval",
        shape::nullable(
            shape::interval("Lower and upper end of the 95% interval; null without a slope.")),
        [](const Out& o) {
          const auto& interval = o.outcome.slope_interval;
          return interval ? Json::array({number_json(interval->low), number_json(interval->high)})
                          : Json(nullptr);
        }},
       {"expected_slope",
        shape::nullable(shape::real("Slope predicted by theory; null if unknown.")),
        [](const Out& o) { return optional_json(o.outcome.expected_slope); }},
       {"intercept",
        shape::nullable(shape::real("log RMSE = intercept + slope log n, natural logarithms.")),
        [](const Out& o) { return optional_json(o.outcome.intercept); }},
       {"efficiency",
        shape::nullable(shape::real("1 / (relative MSE * CPU seconds of a replicate), at the "
                                    "largest n. Measured: differs from run to run.")),
        [](const Out& o) { return optional_json(o.outcome.efficiency); }},
       {"efficiency_by_cost",
        shape::nullable(shape::real("The same with `cost` instead of seconds; reproducible.")),
        [](const Out& o) { return optional_json(o.outcome.efficiency_by_cost); }},
       {"verdict",
        shape::one_of(
            {"agrees", "differs", "biased", "undecided"},
            "agrees: means and slope agree with theory (a false `differs` has a probability of "
            "0.2%); biased: as declared by the estimator; undecided: nothing to compare, fewer "
            "than eight replicates, or too wide an interval of the slope."),
        [](const Out& o) -> Json { return lab::to_text(o.outcome.verdict); }},
       {"explanation", shape::text("Explanation of the verdict."),
        [](const Out& o) -> Json { return o.outcome.explanation; }},
       {"experiment", shape::text(),
        [](const Out& o) -> Json { return o.request.setup.experiment->name; }},
       {"estimator", shape::text(),
        [](const Out& o) -> Json { return o.request.setup.estimator_name(); }},
       {"bias", shape::bias(),
        [](const Out& o) -> Json {
          const lab::Setup& setup = o.request.setup;
          return setup.experiment->estimators[setup.estimator].bias;
        }},
       {"sampler", shape::text(),
        [](const Out& o) -> Json { return o.request.setup.sampler_name; }},
       {"replicates", shape::count(),
        [](const Out& o) -> Json { return o.request.options.replicates; }},
       {"seed", shape::count(), [](const Out& o) -> Json { return o.request.options.seed; }},
       {"params", shape::map(shape::real(), "Effective parameters."),
        [](const Out& o) { return parameters_json(o.request.setup); }},
       {"pattern",
        shape::list(
            shape::list(shape::real()),
            "Points of the first replicate, where the experiment shows them; at most 1024."),
        &pattern_json}}};
  return kView;
}

const View<std::monostate>& lab_cancelled_view() {
  static const View<std::monostate> kView = {
      "LabCancelled",
      "Last line instead of the outcome if the server shuts down.",
      {{"cancelled", shape::flag(), [](const std::monostate&) -> Json { return true; }}}};
  return kView;
}

const View<lab::EstimatorInfo>& estimator_view() {
  using Info = lab::EstimatorInfo;
  static const View<Info> kView = {"",
                                   "",
                                   {{"name", shape::text(), Member<&Info::name>::json},
                                    {"bias", shape::bias(), Member<&Info::bias>::json},
                                    {"summary", shape::text(), Member<&Info::summary>::json}}};
  return kView;
}

const View<lab::ParameterInfo>& parameter_view() {
  using Info = lab::ParameterInfo;
  static const View<Info> kView = {"",
                                   "",
                                   {{"name", shape::text(), Member<&Info::name>::json},
                                    {"min", shape::real(), Member<&Info::min>::number},
                                    {"max", shape::real(), Member<&Info::max>::number},
                                    {"default", shape::real(), Member<&Info::standard>::number},
                                    {"integer", shape::flag(), Member<&Info::is_whole>::json},
                                    {"summary", shape::text(), Member<&Info::summary>::json}}};
  return kView;
}

}  // namespace

std::string lab_point_json(const lab::Point& point) { return dump(lab_point_view().print(point)); }

std::string lab_outcome_json(const LabRequest& request, const lab::Outcome& outcome) {
  return dump(lab_outcome_view().print({request, outcome}));
}

std::string lab_cancelled_json() { return dump(lab_cancelled_view().print({})); }

const View<lab::Experiment>& experiment_view() {
  using Row = lab::Experiment;
  static const View<Row> kView = {
      "Experiment",
      "An experiment of the laboratory.",
      {{"name", shape::text(), Member<&Row::name>::json},
       {"title", shape::text(), Member<&Row::title>::json},
       {"summary", shape::text(), Member<&Row::summary>::json},
       {"estimates", shape::text("Estimated quantity."), Member<&Row::estimates>::json},
       {"formula", shape::text(), Member<&Row::formula>::json},
       {"look_for", shape::text("What to look for."), Member<&Row::look_for>::json},
       {"estimators", shape::list(estimator_view().shape()),
        [](const Row& e) { return print_list(estimator_view(), e.estimators); }},
       {"estimator", shape::text("Default estimator."), Member<&Row::estimator>::json},
       {"samplers", shape::texts("Samplers that it supports."),
        [](const Row& e) -> Json { return lab::allowed_samplers(e); }},
       {"sampler", shape::text("Default sampler."), Member<&Row::sampler>::json},
       {"n", shape::list(shape::count(), "Default values of n."),
        [](const Row& e) -> Json { return std::vector<std::int64_t>(e.n.begin(), e.n.end()); }},
       {"unit", shape::text("Unit of n."), Member<&Row::unit>::json},
       {"replicates", shape::count("Default number of replicates."),
        [](const Row&) -> Json { return kLabReplicatesDefault; }},
       {"params", shape::list(parameter_view().shape()),
        [](const Row& e) { return print_list(parameter_view(), e.parameters); }},
       {"expected", shape::real("Exact value with the default parameters."),
        [](const Row& e) { return number_json(e.expected(lab::default_setup(e))); }},
       {"pattern_dimensions", shape::count("Dimensions of the points that it shows; 0: none."),
        Member<&Row::pattern_dimensions>::json}}};
  return kView;
}

Json experiments_json() {
  Json list = Json::array();
  for (const lab::Experiment* experiment : lab::experiments()) {
    list.push_back(experiment_view().print(*experiment));
  }
  return list;
}

void add_lab_schemas(Json& components) {
  lab_point_view().add_to(components);
  lab_outcome_view().add_to(components);
  lab_cancelled_view().add_to(components);
}

}  // namespace api
