/// The job's group `integrator`: the algorithm, and options that some of them have.
#pragma once

#include <string_view>

#include "api/fields.h"
#include "api/limits.h"
#include "core/settings/registry.h"

namespace api {

/// Of the integrators whose rows list it.
template <typename Row>
constexpr auto own_option(std::string_view pointer, Row row) {
  return option_of(
      pointer, [](const auto& s) -> const auto& { return s.render.integrator; }, &core::integrators,
      row);
}

constexpr auto integrator_row() {
  return group(
      "integrator", "How light paths are traced.",
      choice(
          "type", [](auto& s) -> auto& { return s.render.integrator; }, &core::integrators,
          "Algorithm."),
      number(
          "max_depth", [](auto& s) -> auto& { return s.render.max_depth; }, {0, limits::kMaxDepth},
          "Scattering events on a path; 0 shows emitters only, 1 adds direct light."),
      own_option("/integrator/photons",
                 number(
                     "photons", [](auto& s) -> auto& { return s.render.photons.paths; },
                     {0, limits::kPhotons},
                     "Particles emitted from the lights per sample; 0: as many as the full film "
                     "has pixels, from 1024 to 262144.")),
      own_option(
          "/integrator/radius_m",
          number(
              "radius_m", [](auto& s) -> auto& { return s.render.photons.radius_m; }, {0, 1e6},
              "Radius within which photons are gathered, metres; for sppm, the initial radius. 0: "
              "three pixels at the distance that the camera sees.")),
      own_option(
          "/integrator/alpha",
          number(
              "alpha", [](auto& s) -> auto& { return s.render.photons.alpha; }, {0.1, 1},
              "After N samples of each replicate, the area of the disk and the bias are about "
              "N^(alpha - 1) times the initial ones, while the variance falls as N^-alpha. With "
              "2/3, the squared bias and the variance fall at the same rate.")),
      own_option("/integrator/final_gather",
                 number(
                     "final_gather", [](auto& s) -> auto& { return s.render.photons.final_gather; },
                     {0, limits::kFinalGather},
                     "Directions in which each path queries the photon map one reflection later; "
                     "0: show the map itself, including direct light.")),
      own_option(
          "/integrator/tolerance",
          number(
              "tolerance", [](auto& s) -> auto& { return s.render.cache.tolerance; }, {0.05, 1},
              "Maximum relative interpolation error at which an irradiance record is used; half of "
              "it takes about four times as many records.")),
      own_option("/integrator/rays",
                 number(
                     "rays", [](auto& s) -> auto& { return s.render.cache.rays; },
                     {limits::kRecordRaysLeast, limits::kRecordRays},
                     "Paths over the hemisphere of each record.")),
      own_option("/integrator/records",
                 number(
                     "records", [](auto& s) -> auto& { return s.render.cache.records; },
                     {1, limits::kRecords},
                     "Maximum number of records per replicate. Where there are none, indirect "
                     "light is path traced.")));
}

}  // namespace api
