// `tessera lab`: runs an experiment of the estimator laboratory locally, without a server.
#include "api/lab.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>

#include <nlohmann/json.hpp>

#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "core/base/cgroup.h"
#include "core/lab/plot.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
using nlohmann::json;
namespace lab = core::lab;

struct LabFlags {
  std::string experiment;
  std::string estimator;
  std::string sampler;
  std::vector<std::int64_t> n;
  std::vector<std::string> parameters;  ///< NAME=VALUE
  std::optional<int> replicates;
  std::uint64_t seed = 0;
  int threads = 0;
  bool as_json = false;
  std::string csv;
  std::string svg;
};

std::string text(std::string_view view) { return std::string(view); }

int list(const CLI::App& app, const LabFlags& flags) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() > 0 && option->get_name() != "--json") {
      complain("lab", {ErrorCode::kInvalidArgument, "which experiment?", option->get_name()});
      return kWrongUsage;
    }
  }
  if (flags.as_json) {
    std::puts(api::dump(api::experiments_json()).c_str());
    return kDone;
  }
  for (const lab::Experiment* e : lab::experiments()) {
    std::printf("%-16s %s\n", text(e->name).c_str(), text(e->summary).c_str());
  }
  return kDone;
}

void explain(const lab::Experiment& e) {
  std::printf(
      "%s\n\n%s\n\nEstimates  %s\nFormula    %s\nTo see     %s\n\nEstimators (--estimator, default "
      "%s)\n",
      text(e.title).c_str(), text(e.summary).c_str(), text(e.estimates).c_str(),
      text(e.formula).c_str(), text(e.look_for).c_str(), text(e.estimator).c_str());
  for (const lab::EstimatorInfo& each : e.estimators) {
    std::printf("  %-16s bias %-10s  %s\n", text(each.name).c_str(), text(each.bias).c_str(),
                text(each.summary).c_str());
  }
  if (!e.parameters.empty()) {
    std::puts("\nParameters (--param NAME=VALUE)");
  }
  for (const lab::ParameterInfo& p : e.parameters) {
    std::printf("  %-16s %g in [%g, %g]  %s\n", text(p.name).c_str(), p.standard, p.min, p.max,
                text(p.summary).c_str());
  }
  std::printf("\nSamplers (--sampler, default %s):", text(e.sampler).c_str());
  for (const std::string_view sampler : lab::allowed_samplers(e)) {
    std::printf(" %s", text(sampler).c_str());
  }
  std::printf("\nn (--n) counts %s.\n", text(e.unit).c_str());
}

/// Returns the request that the flags describe, parsed like a request to the server.
core::Result<json> request_of(const LabFlags& flags) {
  json body = {{"experiment", flags.experiment}, {"seed", flags.seed}};
  if (!flags.estimator.empty()) {
    body["estimator"] = flags.estimator;
  }
  if (!flags.sampler.empty()) {
    body["sampler"] = flags.sampler;
  }
  if (!flags.n.empty()) {
    body["n"] = flags.n;
  }
  if (flags.replicates) {
    body["replicates"] = *flags.replicates;
  }
  for (const std::string& parameter : flags.parameters) {
    const std::size_t equals = parameter.find('=');
    const json value = equals == std::string::npos
                           ? json()
                           : json::parse(parameter.substr(equals + 1), nullptr, false);
    if (!value.is_number()) {
      return Error{ErrorCode::kInvalidArgument, "'" + parameter + "' is not NAME=NUMBER",
                   "--param"};
    }
    body["params"][parameter.substr(0, equals)] = value;
  }
  return body;
}

std::string optional_text(const std::optional<double>& value) {
  char buffer[48] = "-";
  if (value) {
    std::snprintf(buffer, sizeof buffer, "%.4g", *value);
  }
  return buffer;
}

void print_point(const lab::Point& p) {
  std::printf("%10lld  %14.8g  %12.4e  %12.4e  %9.3g\n",
              static_cast<long long>(p.n),  // NOLINT(google-runtime-int)
              p.mean, p.rmse, p.standard_error, p.seconds);
  std::fflush(stdout);
}

void print_outcome(const lab::Outcome& outcome) {
  std::printf("\nexpected         %.10g\n", outcome.expected);
  std::printf("slope            %s", optional_text(outcome.slope).c_str());
  if (outcome.slope_interval) {
    std::printf("  [%.4g, %.4g]", outcome.slope_interval->low, outcome.slope_interval->high);
  }
  std::printf("\nexpected slope   %s\n", optional_text(outcome.expected_slope).c_str());
  std::printf("efficiency       %s per CPU second, %s per unit of cost\n",
              optional_text(outcome.efficiency).c_str(),
              optional_text(outcome.efficiency_by_cost).c_str());
  std::printf("verdict          %s\n%s\n", text(lab::to_text(outcome.verdict)).c_str(),
              outcome.explanation.c_str());
}

int write_files(const LabFlags& flags, const api::LabRequest& request,
                const std::vector<lab::Point>& points, const lab::Outcome& outcome) {
  const std::array<std::pair<std::string, std::string>, 2> files = {
      {{flags.csv, lab::points_csv(points)},
       {flags.svg, lab::plot_svg(request.setup, points, outcome)}}};
  for (const auto& [name, content] : files) {
    if (name.empty()) {
      continue;
    }
    if (const auto written = write_file(name, content); !written) {
      return complain("lab", written.error());
    }
  }
  return kDone;
}

int run(const LabFlags& flags) {
  const auto body = request_of(flags);
  if (!body) {
    complain("lab", body.error());
    return kWrongUsage;
  }
  auto request = api::parse_lab_request(body->dump());
  if (!request) {
    for (const api::FieldError& error : request.problem().errors) {
      complain("lab", {ErrorCode::kInvalidArgument, error.detail, error.pointer});
    }
    return kWrongUsage;
  }
  request->options.threads = flags.threads > 0 ? flags.threads : core::usable_threads();
  const bool is_table = !flags.as_json && flags.csv != "-" && flags.svg != "-";
  if (is_table) {
    std::printf("%10s  %14s  %12s  %12s  %9s\n", "n", "mean", "rmse", "std. error", "seconds");
  }
  std::vector<lab::Point> points;
  const auto outcome = lab::run(request->setup, request->options, {}, [&](const lab::Point& point) {
    points.push_back(point);
    if (flags.as_json) {
      std::printf("%s\n", api::lab_point_json(point).c_str());
    } else if (is_table) {
      print_point(point);
    }
    return true;
  });
  if (!outcome) {
    return complain("lab", outcome.error());
  }
  if (flags.as_json) {
    std::printf("%s\n", api::lab_outcome_json(*request, *outcome).c_str());
  } else if (is_table) {
    print_outcome(*outcome);
  }
  if (const int code = write_files(flags, *request, points, *outcome); code != kDone) {
    return code;
  }
  return outcome->verdict == lab::Verdict::kDiffers ? kFailed : kDone;
}

/// Returns the choices of all experiments, since options are completed without knowing the
/// experiment.
Choices lab_choices() {
  Choices all = {{"--sampler", {}}, {"--estimator", {}}};
  const auto add = [](std::vector<std::string>& to, std::string_view name) {
    if (std::find(to.begin(), to.end(), name) == to.end()) {
      to.emplace_back(name);
    }
  };
  for (const lab::Experiment* e : lab::experiments()) {
    for (const lab::EstimatorInfo& each : e->estimators) {
      add(all["--estimator"], each.name);
    }
    for (const std::string_view sampler : lab::allowed_samplers(*e)) {
      add(all["--sampler"], sampler);
    }
  }
  return all;
}

}  // namespace

int lab_command(const Args& args) {
  CLI::App app(
      "Runs an experiment of the estimator laboratory on this machine. Without a name, lists them, "
      "with\n"
      "--json in full. Exit code 1 when theory and measurement differ.",
      "tessera lab");
  LabFlags flags;
  bool wants_text = false;
  app.add_option("experiment", flags.experiment,
                 "Experiment to run; `tessera lab` alone lists them")
      ->type_name("EXPERIMENT");
  app.add_flag("--explain", wants_text,
               "Print the estimated quantity, its formula and what to look for; run nothing");
  app.add_option("--estimator", flags.estimator, "Estimator of the experiment")->type_name("NAME");
  app.add_option("--sampler", flags.sampler, "Sampler to use, if the experiment supports it")
      ->type_name("NAME");
  app.add_option("--n", flags.n, "Numbers of evaluations per replicate, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("N,N");
  app.add_option("--replicates", flags.replicates, "Independent repetitions (64)")->type_name("N");
  app.add_option("--seed", flags.seed,
                 "Random seed; the same seed gives identical results, except for timings")
      ->type_name("N");
  app.add_option("--param", flags.parameters, "Parameter of the experiment; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  app.add_option("--threads", flags.threads, "Threads; results do not depend on the number")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app.add_flag("--json", flags.as_json, "Print JSON lines, as the server streams them");
  app.add_option("--csv", flags.csv, "Write the points to FILE; - is stdout")->type_name("FILE");
  app.add_option("--svg", flags.svg, "Write the plot to FILE; - is stdout")->type_name("FILE");
  const auto chosen = [&] {
    if (flags.experiment.empty()) {
      return list(app, flags);
    }
    if (static_cast<int>(flags.as_json) + static_cast<int>(flags.csv == "-") +
            static_cast<int>(flags.svg == "-") >
        1) {
      complain("lab", {ErrorCode::kInvalidArgument,
                       "only one of --json, --csv and --svg can be stdout", ""});
      return kWrongUsage;
    }
    const lab::Experiment* found = lab::find_experiment(flags.experiment);
    if (wants_text && found != nullptr) {
      explain(*found);
      return kDone;
    }
    return run(flags);
  };
  return parse_and_run(app, args, chosen, &lab_choices);
}

}  // namespace cli
