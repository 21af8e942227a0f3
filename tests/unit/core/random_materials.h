/// Random materials of each kind that the renderer has, for tests of lanes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/description/scene_description.h"
#include "tests/support/statistics.h"

namespace test_support {

/// Which surfaces are drawn.
enum class Drawn {
  kAll,
  kSolids,  ///< the closed ones are boundaries of solids
  kWalls,   ///< most transmit, without a solid
  kFilms    ///< most have a film
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  bool often(float share) { return random_.uniform() < share; }
  float between(float low, float high) { return low + (high - low) * random_.uniform(); }
  int below(int count) { return static_cast<int>(random_.bits() % static_cast<unsigned>(count)); }
  core::Rgb color() { return {between(0.1F, 1), between(0.1F, 1), between(0.1F, 1)}; }
  template <typename T, std::size_t N>
  T one_of(const std::array<T, N>& values) {
    return values[static_cast<std::size_t>(below(static_cast<int>(N)))];
  }
  Drawn drawn = Drawn::kAll;  ///< others without a catcher
  /// Adds a word to the description of what was drawn.
  void say(const std::string& word) { words_ += (words_.empty() ? "" : ", ") + word; }
  const std::string& words() const { return words_; }

 private:
  Random random_;
  std::string words_;
};

struct Kind {
  const char* name;
  void (*make)(core::MaterialDescription& m, Draw& draw);
};
inline constexpr std::array kKinds = {
    Kind{"lambert",
         [](core::MaterialDescription& m, Draw&) {
           m.specular = 0;
           m.roughness = 1;
         }},
    Kind{"plastic",
         [](core::MaterialDescription& m, Draw& draw) { m.ior = draw.between(1.3F, 2); }},
    Kind{"metal", [](core::MaterialDescription& m, Draw&) { m.metallic = 1; }},
    Kind{"half metal",
         [](core::MaterialDescription& m, Draw& draw) {
           m.metallic = draw.between(0.2F, 0.8F);
           m.specular = draw.between(0, 1);
           m.specular_color = draw.color();
         }},
    Kind{"mirror",
         [](core::MaterialDescription& m, Draw& draw) {
           m.metallic = draw.often(0.5F) ? 1.0F : 0.0F;
           m.roughness = 0;
         }},
    Kind{"brushed metal",
         [](core::MaterialDescription& m, Draw& draw) {
           m.metallic = 1;
           m.anisotropy = draw.between(0.3F, 1);
           m.anisotropy_rotation_rad = draw.between(0, 3);
         }},
    Kind{"coat",
         [](core::MaterialDescription& m, Draw& draw) {
           m.clearcoat = draw.between(0.3F, 1);
           m.clearcoat_roughness = draw.often(0.5F) ? 0 : draw.between(0.1F, 0.6F);
           m.clearcoat_normal_scale = draw.between(0.2F, 1);
           m.metallic = draw.often(0.3F) ? 1.0F : 0.0F;
         }},
    Kind{"coated lamp",
         [](core::MaterialDescription& m, Draw& draw) {
           m.clearcoat = draw.between(0.3F, 1);
           m.emissive = draw.color() * draw.between(0.2F, 3);
         }},
    Kind{"cloth",
         [](core::MaterialDescription& m, Draw& draw) {
           m.sheen_color = draw.color();
           m.sheen_roughness = draw.between(0.2F, 1);
           m.clearcoat = draw.often(0.3F) ? draw.between(0.3F, 1) : 0.0F;
         }},
    Kind{"film",
         [](core::MaterialDescription& m, Draw& draw) {
           m.iridescence = draw.between(0.3F, 1);
           m.metallic = draw.often(0.5F) ? 1.0F : 0.0F;
         }},
    Kind{"leaf",
         [](core::MaterialDescription& m, Draw& draw) {
           m.diffuse_transmission = draw.between(0.2F, 0.9F);
           m.diffuse_transmission_color = draw.color();
         }},
    Kind{"thin glass",
         [](core::MaterialDescription& m, Draw& draw) {
           m.transmission = draw.between(0.6F, 1);
           m.roughness = draw.often(0.6F) ? 0 : draw.between(0.1F, 0.6F);
         }},
    Kind{"solid glass",
         [](core::MaterialDescription& m, Draw& draw) {
           m.transmission = 1;
           m.thickness = 1;
           m.roughness = draw.often(0.6F) ? 0 : draw.between(0.1F, 0.6F);
           m.attenuation_distance = draw.often(0.5F) ? 0.4F : 0.0F;
           m.attenuation_color = draw.color();
         }},
    Kind{"holes",
         [](core::MaterialDescription& m, Draw& draw) {
           m.alpha_mode = core::AlphaMode::kMask;
           m.base_alpha = draw.between(0.5F, 1);
         }},
    Kind{"blended",
         [](core::MaterialDescription& m, Draw& draw) {
           m.alpha_mode = core::AlphaMode::kBlend;
           m.base_alpha = draw.between(0.2F, 1);
         }},
    Kind{"glow",
         [](core::MaterialDescription& m, Draw& draw) {
           m.emissive = draw.color() * draw.between(0.2F, 3);
           m.double_sided = draw.often(0.5F);
         }},
    Kind{"unlit", [](core::MaterialDescription& m, Draw&) { m.unlit = true; }},
};

inline void add_film_sometimes(core::MaterialDescription& m, Draw& draw) {
  m.iridescence = draw.often(0.3F) ? draw.between(0.3F, 1) : 0.0F;
  m.iridescence_thickness_max_nm = draw.between(100, 800);
}

inline constexpr std::array kGlass = {
    Kind{"tinted glass",
         [](core::MaterialDescription& m, Draw& draw) {
           m.transmission = 1;
           m.thickness = 1;
           m.roughness = draw.often(0.5F) ? 0 : 0.2F;
           m.attenuation_distance = draw.between(0.2F, 0.6F);
           m.attenuation_color = draw.color();
         }},
    Kind{"unusual glass",
         [](core::MaterialDescription& m, Draw& draw) {
           m.transmission = draw.between(0.3F, 1);
           m.thickness = 1;
           m.ior = draw.between(1.1F, 2);
           m.roughness = draw.often(0.3F) ? 0 : draw.between(0.1F, 1);
           m.metallic = draw.often(0.3F) ? 0.4F : 0.0F;
           m.specular = draw.often(0.5F) ? draw.between(0, 1) : 1.0F;
           m.specular_color = draw.often(0.5F) ? draw.color() : core::Rgb{1, 1, 1};
           m.clearcoat = draw.often(0.3F) ? draw.between(0.3F, 1) : 0.0F;
           m.sheen_color = draw.often(0.2F) ? draw.color() : core::Rgb{};
           m.sheen_roughness = 0.5F;
           add_film_sometimes(m, draw);
         }},
};

inline constexpr std::array kWalls = {
    Kind{"pane",
         [](core::MaterialDescription& m, Draw& draw) {
           m.transmission = draw.between(0.3F, 1);
           m.roughness = draw.often(0.6F) ? 0 : draw.between(0.1F, 1);
           m.ior = draw.between(1, 2);
           m.metallic = draw.often(0.2F) ? 0.4F : 0.0F;
           m.specular = draw.often(0.3F) ? draw.between(0, 1) : 1.0F;
           m.specular_color = draw.often(0.3F) ? draw.color() : core::Rgb{1, 1, 1};
           m.clearcoat = draw.often(0.3F) ? draw.between(0.3F, 1) : 0.0F;
           m.clearcoat_roughness = draw.often(0.5F) ? 0 : 0.3F;
           m.sheen_color = draw.often(0.2F) ? draw.color() : core::Rgb{};
           m.sheen_roughness = 0.5F;
           m.diffuse_transmission = draw.often(0.2F) ? 0.5F : 0.0F;
           m.anisotropy = draw.often(0.2F) ? 0.7F : 0.0F;
           add_film_sometimes(m, draw);
         }},
    Kind{"leaf",
         [](core::MaterialDescription& m, Draw& draw) {
           m.diffuse_transmission = draw.between(0.2F, 1);
           m.diffuse_transmission_color = draw.color();
           m.roughness = draw.often(0.3F) ? 0 : draw.between(0.1F, 1);
           m.specular = draw.often(0.3F) ? 0 : 1.0F;
           m.clearcoat = draw.often(0.2F) ? draw.between(0.3F, 1) : 0.0F;
         }},
};

inline constexpr Kind kFilm = {
    "soap", [](core::MaterialDescription& m, Draw& draw) {
      m.iridescence = draw.between(0.3F, 1);
      m.iridescence_ior = draw.between(1.1F, 2.2F);
      m.iridescence_thickness_max_nm = draw.between(50, 900);
      m.metallic = draw.often(0.4F) ? draw.between(0.3F, 1) : 0.0F;
      m.roughness = draw.often(0.3F) ? 0 : draw.between(0.1F, 1);
      m.specular = draw.often(0.3F) ? draw.between(0, 1) : 1.0F;
      m.specular_color = draw.often(0.3F) ? draw.color() : core::Rgb{1, 1, 1};
      m.clearcoat = draw.often(0.3F) ? draw.between(0.3F, 1) : 0.0F;
      m.sheen_color = draw.often(0.2F) ? draw.color() : core::Rgb{};
      m.sheen_roughness = 0.5F;
    }};

}  // namespace test_support
