#include "api/lab.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "api/fields.h"
#include "api/limits.h"

namespace api {
namespace {

namespace lab = core::lab;

constexpr int kReplicates = 64;
static_assert(limits::kLabEvaluations == lab::kEvaluationsMax && limits::kLabReplicates == lab::kReplicatesMax);

std::vector<std::string_view> experiment_names() {
  std::vector<std::string_view> names;
  for (const lab::Experiment* e : lab::experiments()) {
    names.push_back(e->name);
  }
  return names;
}

void read_experiment(const Json& value, LabRequest& out, const std::string& pointer, Faults& faults) {
  const auto name = read_text(value, {1, 64}, pointer, faults);
  if (!name) {
    return;
  }
  const lab::Experiment* experiment = lab::find_experiment(*name);
  if (experiment == nullptr) {
    faults.add(pointer, not_available(value, experiment_names()));
    return;
  }
  out.setup = lab::default_setup(*experiment);
  out.options.n.assign(experiment->n.begin(), experiment->n.end());
}

void read_estimator(const Json& value, LabRequest& out, const std::string& pointer, Faults& faults) {
  const auto name = read_text(value, {1, 64}, pointer, faults);
  if (!name || out.setup.experiment == nullptr || lab::choose_estimator(out.setup, *name)) {
    return;
  }
  std::vector<std::string_view> names;
  for (const lab::EstimatorInfo& e : out.setup.experiment->estimators) {
    names.push_back(e.name);
  }
  faults.add(pointer, not_available(value, names));
}

void read_sampler(const Json& value, LabRequest& out, const std::string& pointer, Faults& faults) {
  const auto name = read_text(value, {1, 64}, pointer, faults);
  if (name && out.setup.experiment != nullptr && !lab::choose_sampler(out.setup, *name)) {
    faults.add(pointer, not_available(value, lab::allowed_samplers(*out.setup.experiment)));
  }
}

void read_n(const Json& value, LabRequest& out, const std::string& pointer, Faults& faults) {
  if (!value.is_array()) {
    faults.add(pointer, "expected an array, got " + std::string(type_text(value)));
    return;
  }
  if (value.empty() || value.size() > lab::kPointsMax) {
    faults.add(pointer, "has " + std::to_string(value.size()) + " elements, outside [1, " +
                            std::to_string(lab::kPointsMax) + "]");
    return;
  }
  out.options.n.clear();
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (const auto n = read_integer(value[i], {1, static_cast<double>(lab::kTrialMax)},
                                    join_pointer(pointer, std::to_string(i)), faults)) {
      out.options.n.push_back(*n);
    }
  }
}

void read_parameters(const Json& value, LabRequest& out, const std::string& pointer, Faults& faults) {
  if (!expect_object(value, pointer, faults) || out.setup.experiment == nullptr) {
    return;
  }
  const auto parameters = out.setup.experiment->parameters;
  std::vector<std::string_view> names;
  for (const lab::ParameterInfo& p : parameters) {
    names.push_back(p.name);
  }
  refuse_unknown_members(value, names, pointer, faults);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const lab::ParameterInfo& p = parameters[i];
    const auto member = value.find(std::string(p.name));
    if (member == value.end()) {
      continue;
    }
    const Range range = {p.min, p.max};
    const std::string place = join_pointer(pointer, p.name);
    if (p.is_whole) {
      if (const auto number = read_integer(*member, range, place, faults)) {
        out.setup.parameters[i] = static_cast<double>(*number);
      }
    } else if (const auto number = read_number(*member, range, place, faults)) {
      out.setup.parameters[i] = *number;
    }
  }
}

Json parameters_json(const lab::Setup& setup) {
  Json object = Json::object();
  for (std::size_t i = 0; i < setup.parameters.size(); ++i) {
    object[std::string(setup.experiment->parameters[i].name)] = number_json(setup.parameters[i]);
  }
  return object;
}

void print_nothing(const LabRequest& /*request*/, Json& /*object*/) {}

/// The experiment is read first: names, n and parameters are its.
const auto& table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<LabRequest>{"experiment", &read_experiment, &print_nothing,
                            [](const LabRequest&) {
                              Json schema = basic_schema("string", "What is tried; see `experiments` of GET /v1/server.");
                              schema["enum"] = experiment_names();
                              return schema;
                            },
                            true},
      CustomRow<LabRequest>{"estimator", &read_estimator, &print_nothing,
                            [](const LabRequest&) {
                              return basic_schema("string", "One of the experiment's; its own default when absent.");
                            }},
      CustomRow<LabRequest>{"sampler", &read_sampler, &print_nothing,
                            [](const LabRequest&) {
                              return basic_schema("string",
                                                  "Of the registry, as far as the experiment takes it; its own default "
                                                  "when absent.");
                            }},
      CustomRow<LabRequest>{"n", &read_n, &print_nothing,
                            [](const LabRequest&) {
                              Json schema = basic_schema("array",
                                                         "How many evaluations a replicate has, one line of the answer "
                                                         "each; rounded as estimator and sampler need it.");
                              schema["items"] = {{"type", "integer"}, {"minimum", 1}, {"maximum", lab::kTrialMax}};
                              schema["minItems"] = 1;
                              schema["maxItems"] = lab::kPointsMax;
                              return schema;
                            }},
      number(
          "replicates", [](auto& s) -> auto& { return s.options.replicates; }, {2, limits::kLabReplicates},
          "Independent repetitions, which the errors are measured from."),
      number(
          "seed", [](auto& s) -> auto& { return s.options.seed; }, {0, limits::kSeed},
          "The same seed gives the same numbers, times excepted."),
      CustomRow<LabRequest>{"params", &read_parameters, &print_nothing,
                            [](const LabRequest&) {
                              Json schema = basic_schema("object", "Parameters of the experiment, by name.");
                              schema["additionalProperties"] = {{"type", "number"}};
                              return schema;
                            }},
  };
  return kTable;
}

Json finite_json(double value) { return std::isfinite(value) ? number_json(value) : Json(nullptr); }
Json finite_json(const std::optional<double>& value) { return value ? finite_json(*value) : Json(nullptr); }

Json object_of(std::string_view doc, std::initializer_list<std::pair<const char*, Json>> members) {
  Json schema = basic_schema("object", doc);
  Json required = Json::array();
  for (const auto& [name, member] : members) {
    schema["properties"][name] = member;
    required.push_back(name);
  }
  schema["required"] = std::move(required);
  schema["additionalProperties"] = false;
  return schema;
}

Json array_of(Json items, std::string_view doc) {
  Json schema = basic_schema("array", doc);
  schema["items"] = std::move(items);
  return schema;
}

Json named(const char* doc) { return basic_schema("string", doc); }
Json real(const char* doc) { return basic_schema("number", doc); }
Json maybe(const char* doc) { return basic_schema("number", doc, true); }

Json bias_schema() {
  Json schema = basic_schema("string", "");
  schema["enum"] = {"none", "consistent", "biased"};
  return schema;
}

}  // namespace

Parsed<LabRequest> parse_lab_request(std::string_view body) {
  const Parsed<Json> value = parse_json(body, limits::kBodyBytes);
  if (!value) {
    return value.problem();
  }
  LabRequest request;
  request.options.replicates = kReplicates;
  Faults faults;
  read_members(table(), *value, request, "", faults);
  if (faults.empty()) {
    const double total = lab::total_evaluations(request.setup, request.options);
    if (total > lab::kEvaluationsMax) {
      faults.add("/n", "with these replicates the run takes " + dump(number_json(std::floor(total))) +
                           " evaluations, at most " + std::to_string(limits::kLabEvaluations) + " are allowed");
    }
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  return request;
}

std::string lab_point_json(const lab::Point& point) {
  return dump(Json{{"n", point.n},
                   {"n_asked", point.n_asked},
                   {"mean", finite_json(point.mean)},
                   {"rmse", finite_json(point.rmse)},
                   {"standard_error", finite_json(point.standard_error)},
                   {"cost", finite_json(point.cost)},
                   {"seconds", finite_json(point.seconds)}});
}

std::string lab_outcome_json(const LabRequest& request, const lab::Outcome& outcome) {
  const lab::Setup& setup = request.setup;
  Json body = {{"expected", finite_json(outcome.expected)}, {"slope", finite_json(outcome.slope)}};
  body["slope_interval"] = nullptr;
  if (outcome.slope_interval) {
    body["slope_interval"] = {finite_json(outcome.slope_interval->low), finite_json(outcome.slope_interval->high)};
  }
  body["expected_slope"] = finite_json(outcome.expected_slope);
  body["intercept"] = finite_json(outcome.intercept);
  body["efficiency"] = finite_json(outcome.efficiency);
  body["efficiency_by_cost"] = finite_json(outcome.efficiency_by_cost);
  body["verdict"] = lab::to_text(outcome.verdict);
  body["explanation"] = outcome.explanation;
  body["experiment"] = setup.experiment->name;
  body["estimator"] = setup.estimator_name();
  body["bias"] = setup.experiment->estimators[setup.estimator].bias;
  body["sampler"] = setup.sampler_name;
  body["replicates"] = request.options.replicates;
  body["seed"] = request.options.seed;
  body["params"] = parameters_json(setup);
  body["pattern"] = Json::array();
  for (const core::Vec4& p : outcome.pattern) {
    Json point = {number_json(p.x), number_json(p.y)};
    if (setup.experiment->pattern_dimensions > 2) {
      point.push_back(number_json(p.z));
      point.push_back(number_json(p.w));
    }
    body["pattern"].push_back(std::move(point));
  }
  return dump(body);
}

Json experiments_json() {
  Json list = Json::array();
  for (const lab::Experiment* e : lab::experiments()) {
    Json estimators = Json::array();
    for (const lab::EstimatorInfo& each : e->estimators) {
      estimators.push_back({{"name", each.name}, {"bias", each.bias}, {"summary", each.summary}});
    }
    Json parameters = Json::array();
    for (const lab::ParameterInfo& p : e->parameters) {
      parameters.push_back({{"name", p.name},
                            {"min", number_json(p.min)},
                            {"max", number_json(p.max)},
                            {"default", number_json(p.standard)},
                            {"integer", p.is_whole},
                            {"summary", p.summary}});
    }
    list.push_back({{"name", e->name},
                    {"title", e->title},
                    {"summary", e->summary},
                    {"estimates", e->estimates},
                    {"formula", e->formula},
                    {"look_for", e->look_for},
                    {"estimators", std::move(estimators)},
                    {"estimator", e->estimator},
                    {"samplers", lab::allowed_samplers(*e)},
                    {"sampler", e->sampler},
                    {"n", std::vector<std::int64_t>(e->n.begin(), e->n.end())},
                    {"unit", e->unit},
                    {"replicates", kReplicates},
                    {"params", std::move(parameters)},
                    {"expected", finite_json(e->expected(lab::default_setup(*e)))},
                    {"pattern_dimensions", e->pattern_dimensions}});
  }
  return list;
}

Json lab_request_schema() {
  LabRequest defaults;
  defaults.options.replicates = kReplicates;
  return object_schema(table(), defaults, "An experiment to run; whole runs are limited to `lab_evaluations`.");
}

Json lab_point_schema() {
  return object_of("One n, measured.", {{"n", real("In force.")},
                                        {"n_asked", real("As in the request.")},
                                        {"mean", real("Of the replicates.")},
                                        {"rmse", real("Of the replicates against the exact value.")},
                                        {"standard_error", real("Of the mean.")},
                                        {"cost", real("Mean work of a replicate; n unless the experiment counts.")},
                                        {"seconds", real("CPU time of all replicates. Measured, so it differs from "
                                                         "run to run; all other members are reproducible.")}});
}

Json lab_outcome_schema() {
  Json interval = array_of({{"type", "number"}}, "95 %, low and high; null without a slope.");
  interval["type"] = {"array", "null"};
  Json verdict = basic_schema("string",
                              "agrees: means and slope are those of theory (a wrong `differs` has a chance of 0.2 %); "
                              "biased: as the estimator says of itself; undecided: nothing to compare, fewer than "
                              "eight replicates, or a slope that is known too badly to tell.");
  verdict["enum"] = {"agrees", "differs", "biased", "undecided"};
  Json params = basic_schema("object", "Parameters in force.");
  params["additionalProperties"] = {{"type", "number"}};
  return object_of(
      "The outcome, last line of the answer.",
      {{"expected", real("Exact value, from a formula.")},
       {"slope", maybe("Of log RMSE over log n, least squares; null with fewer than two n, or without an error.")},
       {"slope_interval", interval},
       {"expected_slope", maybe("Of theory; null where it gives none.")},
       {"intercept", maybe("log RMSE = intercept + slope log n, natural logarithms.")},
       {"efficiency", maybe("1 / (relative MSE * CPU seconds of a replicate), at the largest n. Measured: differs from "
                            "run to run.")},
       {"efficiency_by_cost", maybe("The same with `cost` for seconds; reproducible.")},
       {"verdict", verdict},
       {"explanation", named("The verdict in words.")},
       {"experiment", named("")},
       {"estimator", named("")},
       {"bias", bias_schema()},
       {"sampler", named("")},
       {"replicates", real("")},
       {"seed", real("")},
       {"params", params},
       {"pattern", array_of(array_of({{"type", "number"}}, ""),
                            "Points of the first replicate, where the experiment shows them; at most 1024.")}});
}

Json experiment_schema() {
  const Json estimator = object_of("", {{"name", named("")}, {"bias", bias_schema()}, {"summary", named("")}});
  const Json parameter = object_of("", {{"name", named("")},
                                        {"min", real("")},
                                        {"max", real("")},
                                        {"default", real("")},
                                        {"integer", basic_schema("boolean", "")},
                                        {"summary", named("")}});
  return object_of("An experiment of the laboratory.",
                   {{"name", named("")},
                    {"title", named("")},
                    {"summary", named("")},
                    {"estimates", named("The quantity.")},
                    {"formula", named("")},
                    {"look_for", named("What there is to see.")},
                    {"estimators", array_of(estimator, "")},
                    {"estimator", named("Default.")},
                    {"samplers", array_of({{"type", "string"}}, "That it takes.")},
                    {"sampler", named("Default.")},
                    {"n", array_of({{"type", "integer"}}, "Default.")},
                    {"unit", named("What n counts.")},
                    {"replicates", real("Default.")},
                    {"params", array_of(parameter, "")},
                    {"expected", real("Exact value with the default parameters.")},
                    {"pattern_dimensions", real("Coordinates of the points shown; 0: none.")}});
}

}  // namespace api
