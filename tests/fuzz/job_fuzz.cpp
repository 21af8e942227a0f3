// Any bytes as a job request: no crash, and accepted requests round-trip without warnings.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "api/job/job_spec.h"
#include "api/requests.h"
#include "core/base/check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view body(reinterpret_cast<const char*>(data), size);
  const auto once = api::parse_job(body);
  if (once) {
    const auto twice = api::parse_job(api::spec_json(once->spec));
    CHECK(twice.has_value());
    CHECK(twice->warnings.empty());
    CHECK(api::same_spec(once->spec, twice->spec));
  } else {
    CHECK(!once.problem().detail.empty());
  }
  const auto patch = api::parse_job_patch(body, once ? once->spec : api::JobSpec{});
  const auto scene = api::parse_scene_from_assets(body);
  const auto merge = api::parse_merge(body);
  static_cast<void>(patch);
  static_cast<void>(scene);
  static_cast<void>(merge);
  return 0;
}
