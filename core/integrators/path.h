/// Path tracing with next-event estimation and BSDF sampling combined by MIS.
/// Source: Kajiya 1986; Veach 1997, chapters 9 and 10.
#pragma once

#include "core/integrators/integrator.h"
#include "core/integrators/medium_stack.h"
#include "core/lights/light_sampler.h"
#include "core/materials/shade.h"
#include "core/sampling/mis.h"

namespace core {

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const IntegratorInput& input);
  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;
  std::unique_ptr<GroupTracer> make_group_tracer() const override;

 private:
  struct State;
  struct Vertex;
  class Group;
  enum class Stage { kOver, kLast, kOpen };
  bool find_surface(State& path, Vertex& vertex) const noexcept;
  void add_background(State& path) const noexcept;
  void add_emission(State& path, const Vertex& vertex) const noexcept;
  void add_direct(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept;
  struct DirectLight;
  bool is_controlled(const Bsdf& bsdf) const noexcept;
  bool fits_control(int depth, const Bsdf& bsdf) const noexcept;
  bool fits_weights(int depth, const Bsdf& bsdf) const noexcept;
  const MisRule& rule(bool fitted) const noexcept { return fitted ? fitted_mis_ : mis_; }
  int candidates(int depth) const noexcept { return depth == 0 ? first_candidates_ : candidates_; }
  float light_count(const State& path) const noexcept;
  static void note_pair(State& path, float share_light, Rgb value) noexcept;
  Rgb arriving(State& path, const Vertex& vertex, DirectLight& direct) const noexcept;
  bool has_closed_form(std::uint32_t light, Vec3 point) const noexcept;
  Rgb control(const State& path, const Vertex& vertex, const Bsdf& bsdf, const LightSample& light) const noexcept;
  DirectLight sample_light(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept;
  DirectLight unshadowed(const State& path, const Vertex& vertex, const Bsdf& bsdf,
                         const LightSample& light) const noexcept;
  bool lets_through(State& path, Rgb& share) const noexcept;
  bool meet(State& path, Vertex& vertex) const noexcept;
  Stage arrive(State& path, Vertex& vertex, const Bsdf& bsdf) const noexcept;
  void follow(State& path) const noexcept;
  void split(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept;
  BsdfSample sample_direction(State& path, const Bsdf& bsdf) const noexcept;
  bool go_on(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept;
  bool scatter(State& path, const Vertex& vertex, const Bsdf& bsdf) const noexcept;
  struct Passage;
  Passage transmittance(State& path, const Ray& ray, MediumStack& media) const noexcept;
  static float ior_of(const State& path, const Material* material) noexcept;
  static float relative_ior(const State& path, const MediumStack& media, const Material& material,
                            bool front) noexcept;
  static void meet_solid(State& path, const Material& material, Vertex& vertex) noexcept;
  static void record_first(State& path, const Vertex& vertex, Rgb albedo) noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  LightSampler lights_;
  MisRule mis_;
  MisRule fitted_mis_{MisType::kOptimal, 1};  ///< where weights are fitted
  Strategy strategy_;
  RouletteType roulette_;
  ControlVariateType control_variate_;
  FitType fit_;
  float shadow_threshold_;  ///< 0: every shadow ray is traced
  int candidates_;          ///< light samples of which one is taken
  int first_candidates_;    ///< the same at the first surface
  bool shares_;             ///< light samples of the first surface are for the whole group
  bool expected_values_;
  int split_count_;
  int max_depth_;
};

}  // namespace core
