// The response to a dry run.
#include <cmath>

#include "api/answers/dry_run.h"
#include "api/answers/views.h"
#include "api/json/values.h"

namespace api {
namespace {

const View<CostView>& cost_view() {
  static const View<CostView> kView = {
      "",
      "Estimate from a pilot of at most half a second.",
      {{"seconds", shape::real("Rendering time on an idle server."),
        Member<&CostView::seconds>::number},
       {"seconds_low", shape::real("Lower end of the interval."),
        Member<&CostView::seconds_low>::number},
       {"seconds_high", shape::real("Upper end of the interval."),
        Member<&CostView::seconds_high>::number},
       {"confidence", shape::real("Confidence level of the interval."),
        Member<&CostView::confidence>::number},
       {"cpu_seconds", shape::real(), Member<&CostView::cpu_seconds>::number},
       {"samples_per_pixel", shape::real("Estimated samples per pixel required."),
        Member<&CostView::samples_per_pixel>::number},
       {"memory_bytes", shape::real("Film and scene."),
        [](const CostView& c) { return number_json(std::round(c.memory_bytes)); }},
       {"memory_bytes_low", shape::real("Memory of the film."),
        [](const CostView& c) { return number_json(std::round(c.memory_bytes_low)); }},
       {"memory_bytes_high",
        shape::real("Memory reserved at admission: the larger of loading and rendering."),
        [](const CostView& c) { return number_json(std::round(c.memory_bytes_high)); }},
       {"pilot_cpu_seconds", shape::real("CPU time of the pilot."),
        Member<&CostView::pilot_cpu_seconds>::number}}};
  return kView;
}

}  // namespace

const View<DryRunView>& dry_run_view() {
  static const View<DryRunView> kView = {
      "DryRun",
      "A job's effective request and its estimated cost.",
      {{"spec", shape::reference("JobSpec"),
        [](const DryRunView& d) { return to_json(d.job.spec); }},
       {"warnings", shape::texts("Same as the warnings of a job."),
        [](const DryRunView& d) -> Json { return d.job.warnings; }},
       {"estimate", cost_view().shape(),
        [](const DryRunView& d) { return cost_view().print(d.cost); }}}};
  return kView;
}

std::string dry_run_json(const DryRunView& dry_run) { return dump(dry_run_view().print(dry_run)); }

}  // namespace api
