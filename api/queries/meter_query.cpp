// Query of the comparison of two meters.
#include <nlohmann/json.hpp>

#include "api/json/query_rows.h"
#include "api/json/schemas.h"
#include "api/json/values.h"
#include "api/queries/queries.h"
#include "api/requests.h"

namespace api {
namespace {

using Query = MeterComparisonQuery;

Json uuid_schema(const Query& /*defaults*/) { return {{"type", "string"}, {"format", "uuid"}}; }

template <std::string Query::*member>
void read_id(const std::string& text, Query& out, const std::string& pointer, Faults& faults) {
  expect_uuid(text, "job", pointer, faults);
  out.*member = text;
}

const auto& table() {
  static constexpr auto kTable = std::tuple{
      ParameterField<Query>{"a", "Job with a meter.", &read_id<&Query::a>, &uuid_schema},
      ParameterField<Query>{"b", "The reference.", &read_id<&Query::b>, &uuid_schema},
  };
  return kTable;
}

}  // namespace

Parsed<MeterComparisonQuery> parse_meter_comparison_query(QueryParams query) {
  Parsed<Query> parsed = parse_query(table(), query, Query{});
  Faults faults;
  if (parsed && parsed->a.empty()) {
    faults.add("/a", "is required: a job with a meter");
  }
  if (parsed && parsed->b.empty()) {
    faults.add("/b", "is required: a job with a meter");
  }
  return faults.empty() ? parsed : Parsed<Query>(faults.problem());
}

Json meter_comparison_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(table(), Query{});
}

}  // namespace api
