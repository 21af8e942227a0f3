#include "api/lab.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "api/json/fields.h"
#include "api/json/limits.h"

namespace api {
namespace {

namespace lab = core::lab;

static_assert(limits::kLabEvaluations == lab::kEvaluationsMax &&
              limits::kLabReplicates == lab::kReplicatesMax);

std::vector<std::string_view> experiment_names() {
  std::vector<std::string_view> names;
  for (const lab::Experiment* e : lab::experiments()) {
    names.push_back(e->name);
  }
  return names;
}

void read_experiment(const Json& value, LabRequest& out, const std::string& pointer,
                     Faults& faults) {
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

void read_estimator(const Json& value, LabRequest& out, const std::string& pointer,
                    Faults& faults) {
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

void read_parameters(const Json& value, LabRequest& out, const std::string& pointer,
                     Faults& faults) {
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

void print_nothing(const LabRequest& /*request*/, Json& /*object*/) {}

/// Reads the experiment first, since it determines names, n and parameters.
const auto& table() {
  static constexpr auto kTable = std::tuple{
      CustomRow<LabRequest>{"experiment", &read_experiment, &print_nothing,
                            [](const LabRequest&) {
                              Json schema = basic_schema(
                                  "string",
                                  "Experiment to run; see `experiments` of GET /v1/server.");
                              schema["enum"] = experiment_names();
                              return schema;
                            },
                            true},
      CustomRow<LabRequest>{"estimator", &read_estimator, &print_nothing,
                            [](const LabRequest&) {
                              return basic_schema(
                                  "string",
                                  "One of the experiment's estimators; its default if absent.");
                            }},
      CustomRow<LabRequest>{
          "sampler", &read_sampler, &print_nothing,
          [](const LabRequest&) {
            return basic_schema(
                "string", "Sampler to use, if the experiment supports it; its default if absent.");
          }},
      CustomRow<LabRequest>{
          "n", &read_n, &print_nothing,
          [](const LabRequest&) {
            Json schema =
                basic_schema("array",
                             "Numbers of evaluations per replicate, each of which gives one line "
                             "of the response; rounded as required by estimator and sampler.");
            schema["items"] = {{"type", "integer"}, {"minimum", 1}, {"maximum", lab::kTrialMax}};
            schema["minItems"] = 1;
            schema["maxItems"] = lab::kPointsMax;
            return schema;
          }},
      number(
          "replicates", [](auto& s) -> auto& { return s.options.replicates; },
          {2, limits::kLabReplicates},
          "Independent repetitions, from which the errors are measured."),
      number(
          "seed", [](auto& s) -> auto& { return s.options.seed; }, {0, limits::kSeed},
          "Random seed; the same seed gives identical results, except for timings."),
      CustomRow<LabRequest>{"params", &read_parameters, &print_nothing,
                            [](const LabRequest&) {
                              Json schema =
                                  basic_schema("object", "Parameters of the experiment, by name.");
                              schema["additionalProperties"] = {{"type", "number"}};
                              return schema;
                            }},
  };
  return kTable;
}

}  // namespace

Parsed<LabRequest> parse_lab_request(std::string_view body) {
  const Parsed<Json> value = parse_json(body, limits::kBodyBytes);
  if (!value) {
    return value.problem();
  }
  LabRequest request;
  request.options.replicates = kLabReplicatesDefault;
  Faults faults;
  read_members(table(), *value, request, "", faults);
  if (faults.empty()) {
    const double total = lab::total_evaluations(request.setup, request.options);
    if (total > lab::kEvaluationsMax) {
      faults.add("/n", "with these replicates the run needs " +
                           dump(number_json(std::floor(total))) + " evaluations, at most " +
                           std::to_string(limits::kLabEvaluations) + " are allowed");
    }
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  return request;
}

Json lab_request_schema() {
  LabRequest defaults;
  defaults.options.replicates = kLabReplicatesDefault;
  return object_schema(table(), defaults,
                       "An experiment to run; whole runs are limited to `lab_evaluations`.");
}

}  // namespace api
