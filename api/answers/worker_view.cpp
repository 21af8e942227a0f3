#include "api/answers/worker_view.h"

#include <tuple>

#include "api/json/faults.h"
#include "api/json/field_rows.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"
#include "api/json/shapes.h"
#include "api/json/time_text.h"
#include "api/json/values.h"
#include "api/json/view_rows.h"

namespace api {
namespace {

constexpr std::int64_t kTextCharacters = 255;
constexpr double kSecondsMax = 1e9;

void read_units(const Json& value, WorkerReport& out, const std::string& pointer, Faults& faults) {
  if (!value.is_object() || value.size() > static_cast<std::size_t>(limits::kWorkerThreads)) {
    faults.add(pointer, "expected an object of at most " + std::to_string(limits::kWorkerThreads) +
                            " units with their CPU seconds");
    return;
  }
  for (const auto& unit : value.items()) {
    const std::string place = join_pointer(pointer, unit.key());
    if (const auto seconds = read_number(unit.value(), {0, kSecondsMax}, place, faults)) {
      out.units[unit.key()] = *seconds;
    }
  }
}

const auto& report_table() {
  static constexpr auto kTable = std::tuple{
      required_text("build", &WorkerReport::build, {1, kTextCharacters},
                    "Id of the worker's build."),
      required_text("arithmetic", &WorkerReport::arithmetic, {1, kTextCharacters},
                    "Arithmetic class of the worker."),
      number("threads", &WorkerReport::threads, {1, limits::kWorkerThreads},
             "Units that it renders concurrently."),
      flag("draining", &WorkerReport::draining, "The worker takes no more units."),
      CustomRow<WorkerReport>{
          "units", &read_units,
          [](const WorkerReport& report, Json& json) { json["units"] = report.units; },
          [](const WorkerReport&) {
            return shape::map(shape::real("CPU seconds spent on it."),
                              "Units that the worker holds.");
          }},
  };
  return kTable;
}

const auto& unit_table() {
  static constexpr auto kTable = std::tuple{
      required_text("worker", &UnitRequest::worker, {1, kTextCharacters}, "Id of the worker."),
      text("fault", &UnitRequest::fault, {0, limits::kNameCharacters},
           "Why a returned unit was not rendered; empty: not because of a fault."),
  };
  return kTable;
}

const View<WorkerOrders>& orders_view() {
  static const View<WorkerOrders> kView = {
      "WorkerOrders",
      "Orders for a worker.",
      {{"suitable", shape::flag("Whether the worker gets units."),
        [](const WorkerOrders& o) -> Json { return o.reason.empty(); }},
       {"reason", shape::nullable(shape::text("Why the worker gets no units.")),
        [](const WorkerOrders& o) -> Json { return text_or_null(o.reason); }},
       {"report_seconds", shape::real("Time until the next report."),
        Member<&WorkerOrders::report_seconds>::json},
       {"dropped", shape::texts("Units whose results are no longer needed."),
        Member<&WorkerOrders::dropped>::json}}};
  return kView;
}

const View<WorkInputs>& inputs_view() {
  static const View<WorkInputs> kView = {
      "WorkInputs",
      "Inputs of a job's units.",
      {{"spec", shape::object("The job's `spec`."),
        [](const WorkInputs& w) { return to_json(w.spec); }},
       {"files",
        shape::map(shape::text(),
                   "Asset ids by uri; \"\" is the glTF document. Empty: a built-in scene."),
        Member<&WorkInputs::files>::json}}};
  return kView;
}

const View<WorkerView>& worker_view() {
  static const View<WorkerView> kView = {
      "Worker",
      "A process that renders units of this server's jobs.",
      {{"id", shape::text("Changes each time the worker is started."),
        Member<&WorkerView::id>::json},
       {"build", shape::text("Build of the worker."), Member<&WorkerView::build>::json},
       {"arithmetic", shape::text("Arithmetic class of the worker."),
        Member<&WorkerView::arithmetic>::json},
       {"threads", shape::count("Units that it renders concurrently."),
        Member<&WorkerView::threads>::json},
       {"rate", shape::real("Pixel samples per second while rendering."),
        Member<&WorkerView::rate>::number},
       {"leases", shape::count("Units that the worker holds."), Member<&WorkerView::leases>::json},
       {"held",
        shape::texts("Names of those of them whose jobs the key can see. Each begins with its "
                     "job's id and a dot."),
        Member<&WorkerView::held>::json},
       {"units", shape::count("Results that were accepted."), Member<&WorkerView::units>::json},
       {"faults", shape::count("Units that it lost or failed, or whose results were wrong."),
        Member<&WorkerView::faults>::json},
       {"state",
        shape::one_of({"idle", "working", "draining", "suspended", "unsuitable", "left", "lost"}),
        Member<&WorkerView::state>::json},
       {"reason",
        shape::nullable(
            shape::text("Why the worker is unsuitable or suspended; for the operator and keys with "
                        "the scope admin, with the error that it reported.")),
        [](const WorkerView& w) -> Json { return text_or_null(w.reason); }},
       {"seen_at", shape::time("Time of the last report."),
        [](const WorkerView& w) -> Json { return rfc3339(w.seen_at_unix_seconds); }}}};
  return kView;
}

const View<WorkerTile>& tile_view() {
  static const View<WorkerTile> kView = {
      "WorkerTile",
      "A tile that a worker is rendering. Pixels count from the top left of the full film.",
      {{"worker", shape::text("Id of the worker."), Member<&WorkerTile::worker>::json},
       {"x", shape::count(), [](const WorkerTile& t) -> Json { return t.rect.x; }},
       {"y", shape::count(), [](const WorkerTile& t) -> Json { return t.rect.y; }},
       {"width", shape::count(), [](const WorkerTile& t) -> Json { return t.rect.width; }},
       {"height", shape::count(), [](const WorkerTile& t) -> Json { return t.rect.height; }}}};
  return kView;
}

Json list_schema(const char* doc, const char* member, const char* schema) {
  Json list = basic_schema("object", doc);
  list["properties"] = {{member, shape::list(shape::reference(schema), "")}};
  list["required"] = {member};
  list["additionalProperties"] = false;
  return list;
}

}  // namespace

Parsed<WorkerReport> parse_worker_report(std::string_view body) {
  return parse_body<WorkerReport>(report_table(), body);
}

Parsed<UnitRequest> parse_unit_request(std::string_view body) {
  return parse_body<UnitRequest>(unit_table(), body);
}

std::string worker_orders_json(const WorkerOrders& orders) {
  return dump(orders_view().print(orders));
}

std::string work_inputs_json(const WorkInputs& inputs) { return dump(inputs_view().print(inputs)); }

std::string worker_list_json(std::span<const WorkerView> workers) {
  return dump({{"workers", print_list(worker_view(), workers)}});
}

std::string worker_tiles_json(std::span<const WorkerTile> tiles) {
  return dump({{"tiles", print_list(tile_view(), tiles)}});
}

void add_worker_schemas(Json& components) {
  components["WorkerReport"] =
      as_request(object_schema(report_table(), WorkerReport{}, "State of a worker and its units."));
  components["UnitRequest"] =
      as_request(object_schema(unit_table(), UnitRequest{}, "Lease or return of a unit."));
  components["WorkerOrders"] = orders_view().schema();
  components["WorkInputs"] = inputs_view().schema();
  components["Worker"] = worker_view().schema();
  components["WorkerTile"] = tile_view().schema();
  components["WorkerList"] = list_schema("All workers seen recently.", "workers", "Worker");
  components["WorkerTiles"] =
      list_schema("Tiles of a job that workers are rendering.", "tiles", "WorkerTile");
}

}  // namespace api
