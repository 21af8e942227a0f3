#include "core/scene_io/gltf_ior.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_model.h"

namespace core {
namespace {

Result<std::array<float, 3>> three_numbers(const tinygltf::Value& value, const std::string& where) {
  if (!value.IsArray() || value.ArrayLen() != 3) {
    return invalid(where, "is not an array of 3 numbers");
  }
  std::array<float, 3> out{};
  for (std::size_t i = 0; i < out.size(); ++i) {
    const tinygltf::Value& one = value_array(value)[i];
    const std::string place = where + "/" + std::to_string(i);
    if (!one.IsNumber()) {
      return invalid(place, "is not a number");
    }
    out[i] = static_cast<float>(one.GetNumberAsDouble());
    if (!std::isfinite(out[i])) {
      return invalid(place, "is too large for a 32-bit float");
    }
  }
  return out;
}

/// At every nanometre that rendering samples (core/color/wavelengths.h).
Status check_index(const IorCurve& curve, const std::string& where) {
  constexpr int kFirstNm = 380;
  constexpr int kLastNm = 780;
  constexpr float kMost = 1e4F;  // as of KHR_materials_ior (gltf_schema.cpp)
  // The index has a pole at each resonance, which may lie between two of the nanometres below.
  for (std::size_t i = 0; i < curve.c.size(); ++i) {
    const float nm = 1000 * std::sqrt(curve.c[i]);
    if (curve.a[i] != 0 && nm >= kFirstNm && nm <= kLastNm) {
      return invalid(where + "/c_um2/" + std::to_string(i), "a resonance within 380 to 780 nm");
    }
  }
  for (int nm = kFirstNm; nm <= kLastNm; ++nm) {
    const float n = curve.at(static_cast<float>(nm));
    if (!(n >= 1 && n <= kMost)) {
      char text[128];
      std::snprintf(text, sizeof text,
                    "the index of refraction is %.4g at %d nm; [1, 10000] is allowed from %d to "
                    "%d nm",
                    static_cast<double>(n), nm, kFirstNm, kLastNm);
      return invalid(where, text);
    }
  }
  return ok_status();
}

}  // namespace

Result<IorCurve> read_ior_curve(const tinygltf::Value& extras, const std::string& where) {
  const bool cauchy = extras.IsObject() && extras.Has("ior_cauchy");
  const bool sellmeier = extras.IsObject() && extras.Has("ior_sellmeier");
  IorCurve curve;
  if (!cauchy && !sellmeier) {
    return curve;
  }
  const std::string member = where + "/extras/" + (cauchy ? "ior_cauchy" : "ior_sellmeier");
  if (cauchy && sellmeier) {
    return invalid(member, "a material has one of ior_cauchy and ior_sellmeier");
  }
  if (cauchy) {
    const auto a = three_numbers(extras.Get("ior_cauchy"), member);
    if (!a) {
      return a.error();
    }
    curve = {IorFormula::kCauchy, *a, {}};
  } else {
    const tinygltf::Value& object = extras.Get("ior_sellmeier");
    if (!object.IsObject()) {
      return invalid(member, "is not an object with the members b and c_um2");
    }
    // A member that is missing reads as null, which is no array.
    const auto b = three_numbers(object.Get("b"), member + "/b");
    if (!b) {
      return b.error();
    }
    const auto c = three_numbers(object.Get("c_um2"), member + "/c_um2");
    if (!c) {
      return c.error();
    }
    curve = {IorFormula::kSellmeier, *b, *c};
  }
  if (const Status fits = check_index(curve, member); !fits) {
    return fits.error();
  }
  return curve;
}

}  // namespace core
