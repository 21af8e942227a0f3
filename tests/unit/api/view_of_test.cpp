// From a job to its view: which inputs are asked for, and what becomes of them.
#include "api/job/view_of.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "core/lights/made_environment.h"
#include "core/scene/drawn.h"
#include "core/scene/ground.h"
#include "tests/support/scenes.h"

namespace {

using core::Vec3;

/// Inputs in memory that note what they are asked for.
class NotedInputs final : public api::ViewInputs {
 public:
  explicit NotedInputs(core::GroundSettings ground = {}) : ground_(ground) {}

  core::Result<Model> model() override {
    asked.emplace_back("model");
    return Model{core::bounds_of(description), description.origin, description.cameras};
  }
  core::Result<std::shared_ptr<const core::Scene>> scene(Vec3 view_direction) override {
    asked.emplace_back("scene");
    direction = view_direction;
    core::SceneDescription with_ground = description;
    core::add_ground(with_ground, ground_, view_direction);
    return test_support::build(std::move(with_ground));
  }
  core::Result<std::shared_ptr<const core::MotionTarget>> later(double time_seconds,
                                                                core::Place) override {
    asked.push_back("later " + std::to_string(time_seconds));
    return std::make_shared<const core::MotionTarget>(description);
  }
  core::Result<std::shared_ptr<const core::Environment>> environment(
      const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) override {
    asked.push_back("environment " + asset.value_or("made"));
    if (asset) {
      return core::Error{core::ErrorCode::kNotFound, "no such image", "/environment/asset"};
    }
    return core::make_environment(settings);
  }

  std::vector<std::string> asked;
  Vec3 direction;
  core::SceneDescription description = test_support::cornell();

 private:
  core::GroundSettings ground_;
};

using Asked = std::vector<std::string>;

api::JobSpec spec() {
  api::JobSpec out;
  out.environment_choice = api::EnvironmentChoice::kBlack;
  return out;
}

TEST(ViewOf, AsksForTheSceneAlone) {
  NotedInputs inputs;
  const auto view = api::view_of(spec(), inputs);
  ASSERT_TRUE(view);
  EXPECT_EQ(inputs.asked, Asked{"scene"});
  EXPECT_EQ(view->environment, nullptr);
  EXPECT_EQ(view->later, nullptr);
  EXPECT_FALSE(view->measured) << "settling is a step of its own";
}

TEST(ViewOf, PlacesASweepBehindTheModelAsTheCameraSeesIt) {
  api::JobSpec job = spec();
  job.render.ground.type = core::GroundType::kSweep;
  job.camera.position = core::Place{5, 1, 0};
  job.camera.target = core::Place{0, 1, 0};
  NotedInputs inputs(job.render.ground);
  ASSERT_TRUE(api::view_of(job, inputs));
  EXPECT_EQ(inputs.asked, (Asked{"model", "scene"}));
  EXPECT_EQ(inputs.direction.x, -1);
  EXPECT_EQ(inputs.direction.y, 0);
  EXPECT_EQ(inputs.direction.z, 0);
  // A catcher is the same from all directions, so no camera is needed.
  job.render.ground.type = core::GroundType::kCatcher;
  NotedInputs others(job.render.ground);
  ASSERT_TRUE(api::view_of(job, others));
  EXPECT_EQ(others.asked, Asked{"scene"});
}

TEST(ViewOf, AsksForTheSecondTimeOfMotion) {
  api::JobSpec job = spec();
  job.render.film.motion = true;
  job.time_seconds = 2;
  job.motion_seconds = 0.5;
  NotedInputs inputs;
  const auto view = api::view_of(job, inputs);
  ASSERT_TRUE(view);
  EXPECT_EQ(inputs.asked, (Asked{"scene", "later 2.500000"}));
  EXPECT_NE(view->later, nullptr);
}

TEST(ViewOf, ReadsTheFileAtTheTimesThatAreSeen) {
  api::JobSpec job = spec();
  job.time_seconds = 2;
  job.variant = "red";
  job.render.shutter_seconds = 0.5;
  const core::SceneMoment whole = api::scene_moment(job);
  EXPECT_EQ(whole.time_seconds, 2);
  EXPECT_EQ(whole.shutter_seconds, 0.5);
  EXPECT_EQ(whole.variant, "red");
  EXPECT_FALSE(whole.geometry_only);
  const core::SceneMoment model = api::model_moment(job);
  EXPECT_EQ(model.time_seconds, 2);
  EXPECT_EQ(model.shutter_seconds, 0);
  EXPECT_EQ(model.variant, "red");
  const core::SceneMoment later = api::later_moment(job, 3, {1, 2, 3});
  EXPECT_EQ(later.time_seconds, 3);
  EXPECT_EQ(later.shutter_seconds, 0);
  EXPECT_EQ(later.variant, "red");
  EXPECT_TRUE(later.geometry_only);
  ASSERT_TRUE(later.origin);
  EXPECT_EQ(later.origin->y, 2);
}

TEST(ViewOf, ResolvesTheEnvironment) {
  api::JobSpec job = spec();
  job.environment_choice = api::EnvironmentChoice::kGiven;
  NotedInputs given;
  ASSERT_TRUE(api::view_of(job, given));
  EXPECT_EQ(given.asked, (Asked{"scene", "environment made"}));
  job.environment_asset = "sky";
  NotedInputs missing;
  const auto refused = api::view_of(job, missing);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, "/environment/asset");
  // The emitter of the box is not strong enough to count as a light, so an absent environment is
  // white.
  job = spec();
  job.environment_choice = api::EnvironmentChoice::kAutomatic;
  NotedInputs automatic;
  const auto view = api::view_of(job, automatic);
  ASSERT_TRUE(view);
  api::JobSpec settled = job;
  api::resolve_environment(settled, view->scene->summary());
  EXPECT_EQ(view->environment != nullptr,
            settled.environment_choice == api::EnvironmentChoice::kGiven);
  // The spec of the caller stays as it is.
  EXPECT_EQ(job.environment_choice, api::EnvironmentChoice::kAutomatic);
}

}  // namespace
