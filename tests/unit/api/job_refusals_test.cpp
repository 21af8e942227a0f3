// Every refusal of the job request: exact pointer and message.
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_checks.h"
#include "api/job/job_spec.h"

namespace {

struct Case {
  std::string members;  ///< in addition to scene
  std::string pointer;
  std::string detail;
};

class JobRefusal : public testing::TestWithParam<Case> {};

TEST_P(JobRefusal, HasThePointerAndTheReason) {
  const Case& c = GetParam();
  const auto parsed = api::parse_job(R"({"scene":"cornell-box",)" + c.members + "}");
  ASSERT_FALSE(parsed) << c.members;
  EXPECT_EQ(parsed.problem().status, 422);
  ASSERT_EQ(parsed.problem().errors.size(), 1U) << parsed.problem().detail;
  EXPECT_EQ(parsed.problem().errors[0].pointer, c.pointer);
  EXPECT_EQ(parsed.problem().errors[0].detail, c.detail);
}

INSTANTIATE_TEST_SUITE_P(
    Numbers, JobRefusal,
    testing::Values(
        Case{R"("seed":-1)", "/seed", "-1 is outside [0, 9007199254740991]"},
        Case{R"("seed":9007199254740992)", "/seed",
             "9007199254740992 is outside [0, 9007199254740991]"},
        Case{R"("seed":18446744073709551615)", "/seed",
             "18446744073709551615 is outside [0, 9007199254740991]"},
        Case{R"("seed":1e300)", "/seed", "1e+300 is outside [0, 9007199254740991]"},
        Case{R"("seed":1e999)", "/seed", "1e999 is too large for a number"},
        Case{R"("seed":0.5)", "/seed", "0.5 is not a whole number"},
        Case{R"("seed":"1")", "/seed", "expected a whole number, got a string"},
        Case{R"("seed":null)", "/seed", "expected a whole number, got null"},
        Case{R"("priority":101)", "/priority", "101 is outside [-100, 100]"},
        Case{R"("priority":-101)", "/priority", "-101 is outside [-100, 100]"},
        Case{R"("priority":true)", "/priority", "expected a whole number, got true or false"},
        Case{R"("time_seconds":"a")", "/time_seconds", "expected a number, got a string"},
        Case{R"("time_seconds":1e7)", "/time_seconds", "10000000 is outside [-1000000, 1000000]"},
        Case{R"("film":{"width":0})", "/film/width", "0 is outside [1, 16384]"},
        Case{R"("film":{"width":16385})", "/film/width", "16385 is outside [1, 16384]"},
        Case{R"("film":{"height":1.25})", "/film/height", "1.25 is not a whole number"},
        Case{R"("film":{"filter":{"radius":0}})", "/film/filter/radius", "0 is outside (0, 8]"},
        Case{R"("film":{"filter":{"radius":8.5}})", "/film/filter/radius", "8.5 is outside (0, 8]"},
        Case{R"("integrator":{"max_depth":1025})", "/integrator/max_depth",
             "1025 is outside [0, 1024]"},
        Case{R"("estimator":{"roulette":{"type":"threshold","delta":-1}})",
             "/estimator/roulette/delta", "-1 is outside [0, 1000000000]"},
        Case{R"("estimator":{"splitting":{"type":"fixed","count":0}})",
             "/estimator/splitting/count", "0 is outside [1, 64]"},
        Case{R"("estimator":{"expected_values":"no"})", "/estimator/expected_values",
             "expected true or false, got a string"},
        Case{R"("light_sampler":{"type":"ris","candidates":65})", "/light_sampler/candidates",
             "65 is outside [1, 64]"},
        Case{R"("light_sampler":{"type":"restir","block":9})", "/light_sampler/block",
             "9 is outside [1, 8]"},
        Case{R"("light_sampler":{"type":"restir","history":17})", "/light_sampler/history",
             "17 is outside [1, 16]"},
        Case{R"("light_sampler":{"type":"restir","candidates_per_pixel":0})",
             "/light_sampler/candidates_per_pixel", "0 is outside [1, 64]"},
        Case{R"("estimator":{"mis":{"exponent":0.5}})", "/estimator/mis/exponent",
             "0.5 is outside [1, 16]"},
        Case{R"("sampler":{"replicates":3})", "/sampler/replicates",
             "3 is odd; replicates come in pairs"},
        Case{R"("sampler":{"replicates":0})", "/sampler/replicates", "0 is outside [2, 64]"},
        Case{R"("sampler":{"first_replicate":5})", "/sampler/first_replicate",
             "5 is odd; replicates come in pairs"},
        Case{R"("sampler":{"first_replicate":-2})", "/sampler/first_replicate",
             "-2 is outside [0, 65536]"},
        Case{R"("sampler":{"replicates":66})", "/sampler/replicates", "66 is outside [2, 64]"}));

INSTANTIATE_TEST_SUITE_P(
    Texts, JobRefusal,
    testing::Values(
        Case{R"("name":7)", "/name", "expected a string, got a number"},
        Case{R"("name":")" + std::string(256, 'n') + R"(")", "/name",
             "has 256 characters, outside [0, 255]"},
        Case{R"("name":"a\nb")", "/name", "contains a control character"},
        Case{R"("name":"a\u0000b")", "/name", "contains a control character"},
        Case{R"("variant":"")", "/variant", "is empty"},
        Case{R"("labels":[])", "/labels", "expected an object, got an array"},
        Case{R"("labels":{"":"x"})", "/labels/", "the key is empty"},
        Case{R"("labels":{"a/b~c":1})", "/labels/a~1b~0c", "expected a string, got a number"},
        Case{R"("labels":{")" + std::string(64, 'k') + R"(":"x"})",
             "/labels/" + std::string(64, 'k'), "the key has 64 characters, outside [1, 63]"},
        Case{R"("labels":{"k":")" + std::string(256, 'v') + R"("})", "/labels/k",
             "has 256 characters, outside [0, 255]"},
        Case{R"("labels":{"a":"","b":"","c":"","d":"","e":"","f":"","g":"","h":"","i":"",)"
             R"("j":"","k":"",)"
             R"("l":"","m":"","n":"","o":"","p":"","q":""})",
             "/labels", "has 17 labels; at most 16 are allowed"}));

INSTANTIATE_TEST_SUITE_P(
    Names, JobRefusal,
    testing::Values(
        Case{R"("integrator":{"type":"ray-march"})", "/integrator/type",
             "Unknown value 'ray-march'; expected one of: path, direct, "
             "light-trace, bdpt, mlt, photon-map, sppm, irradiance-cache, auto"},
        Case{R"("integrator":"path")", "/integrator", "expected an object, got a string"},
        Case{R"("sampler":{"type":"dice"})", "/sampler/type",
             "Unknown value 'dice'; expected one of: independent, antithetic, "
             "stratified, latin-hypercube, orthogonal-array, halton, sobol, zsobol"},
        Case{R"("light_sampler":{"type":"moon"})", "/light_sampler/type",
             "Unknown value 'moon'; expected one of: uniform, power, tree, ris, restir"},
        Case{R"("adaptive":{"type":"magic"})", "/adaptive/type",
             "Unknown value 'magic'; expected one of: none, pilot"},
        Case{R"("adaptive":{"type":"crosshalf"})", "/adaptive/type",
             "'crosshalf' is available only in the laboratory, because its image or its error "
             "estimate is not correct: experiment 'stopping-bias', estimator 'cross-half'"},
        Case{R"("adaptive":{"type":"sequential"})", "/adaptive/type",
             "'sequential' is available only in the laboratory, because its image or its error "
             "estimate is not correct: experiment 'stopping-bias', estimator 'standard-error'"},
        Case{R"("adaptive":{"type":"none","min_samples":8})", "/adaptive/min_samples",
             "applies only to type 'pilot'"},
        Case{R"("adaptive":{"type":"pilot","min_samples":0})", "/adaptive/min_samples",
             "0 is outside [1, 65536]"},
        Case{R"("adaptive":{"type":"pilot","dilation":9})", "/adaptive/dilation",
             "9 is outside [0, 8]"},
        Case{R"("adaptive":{"type":"pilot","granularity":"image"})", "/adaptive/granularity",
             "Unknown value 'image'; expected one of: pixel, tile"},
        Case{R"("estimator":{"strategy":"guess"})", "/estimator/strategy",
             "Unknown value 'guess'; expected one of: mis, light, bsdf, cosine, uniform"},
        Case{R"("estimator":{"mis":{"type":"least"}})", "/estimator/mis/type",
             "Unknown value 'least'; expected one of: balance, power, maximum, optimal"},
        Case{R"("estimator":{"strategy":"light","mis":{"type":"optimal"}})", "/estimator/mis",
             "weights cannot be combined with a strategy other than 'mis'"},
        Case{R"("estimator":{"mis":{"type":"optimal","exponent":2}})", "/estimator/mis/exponent",
             "applies only to type 'power'"},
        Case{R"("estimator":{"mis":{"type":"optimal"}},"light_sampler":{"type":"ris"})",
             "/estimator/mis/type",
             "'optimal' cannot be combined with light sampler 'ris', whose density is unknown"},
        Case{R"("estimator":{"mis":{"type":"optimal"},"roulette":{"type":"threshold"}})",
             "/estimator/mis/type",
             "'optimal' cannot be combined with roulette 'threshold', which skips shadow rays"},
        Case{R"("estimator":{"mis":{"type":"optimal"},"control_variate":{"type":"regression"}})",
             "/estimator/mis/type",
             "'optimal' cannot be combined with a control variate; it is one"},
        Case{R"("estimator":{"mis":{"type":"optimal"},"expected_values":false})",
             "/estimator/mis/type",
             "'optimal' cannot be combined with expected_values false, where paths end at random"},
        Case{R"("estimator":{"roulette":{"type":"adjoint"}})", "/estimator/roulette/type",
             "Unknown value 'adjoint'; expected one of: none, throughput, threshold"},
        Case{R"("estimator":{"splitting":{"type":"ears"}})", "/estimator/splitting/type",
             "Unknown value 'ears'; expected one of: none, fixed, measured"},
        Case{R"("estimator":{"control_variate":{"type":"magic"}})",
             "/estimator/control_variate/type",
             "Unknown value 'magic'; expected one of: none, analytic, regression"},
        Case{R"("estimator":{"strategy":"cosine","control_variate":{"type":"regression"}})",
             "/estimator/control_variate",
             "a control variate cannot be combined with strategies 'bsdf', 'cosine' and 'uniform'"},
        Case{R"("estimator":{"strategy":"bsdf","control_variate":{"type":"analytic"}})",
             "/estimator/control_variate",
             "a control variate cannot be combined with strategies 'bsdf', 'cosine' and 'uniform'"},
        Case{R"("shutter_seconds":1,"time_seconds":null)", "/shutter_seconds",
             "requires time_seconds: in the rest pose nothing moves"},
        Case{R"("shutter_seconds":1,"integrator":{"type":"bdpt"})", "/shutter_seconds",
             "is not supported by integrator 'bdpt', but by 'path', 'direct'"},
        Case{R"("spectral":1)", "/spectral", "expected true or false, got a number"},
        Case{R"("spectral":true,"integrator":{"type":"bdpt"})", "/spectral",
             "is not supported by integrator 'bdpt', but by 'path', 'direct', 'auto'"},
        Case{R"("spectral":true,"estimator":{"strategy":"cosine"})", "/estimator/strategy",
             "strategies 'cosine' and 'uniform' cannot be combined with spectral true"},
        Case{R"("spectral":true,"estimator":{"mis":{"type":"optimal"}})", "/estimator/mis/type",
             "'optimal' cannot be combined with spectral true"},
        Case{R"("spectral":true,"estimator":{"control_variate":{"type":"analytic"}})",
             "/estimator/control_variate/type",
             "a control variate cannot be combined with spectral true"},
        Case{R"("spectral":true,"light_sampler":{"type":"restir"})", "/light_sampler/type",
             "light sampler 'restir' cannot be combined with spectral true"},
        Case{R"("spectral":true,"film":{"layers":["irradiance"]})", "/spectral",
             "spectral true cannot be combined with layer 'irradiance', which uses RGB"},
        Case{R"("spectral":true,"ground":{"type":"catcher"})", "/spectral",
             "spectral true cannot be combined with ground 'catcher'"},
        Case{R"("medium":{"type":"fog"})", "/medium/type",
             "Unknown value 'fog'; expected one of: homogeneous"},
        Case{R"("medium":{"scattering":[1,-1,1]})", "/medium/scattering/1",
             "-1 is outside [0, 1000000]"},
        Case{R"("medium":{},"estimator":{"control_variate":{"type":"analytic"}})",
             "/estimator/control_variate/type",
             "a control variate cannot be combined with a medium that scatters"},
        Case{
            R"("film":{"layers":["bounce:1"]},"estimator":{"mis":{"type":"optimal"}})",
            "/estimator/mis/type",
            "'optimal' cannot be combined with layers bounce:N, light:NAME, st:S,T and irradiance"},
        Case{R"("film":{"layers":["bounce:1"]},"integrator":{"type":"mlt"})", "/film/layers/0",
             "'bounce:1' is not supported by integrator 'mlt', but by 'path', 'bdpt', 'auto'"},
        Case{R"("class":"urgent")", "/class",
             "Unknown value 'urgent'; expected one of: normal, preview"},
        Case{R"("webhook":{"url":"x"})", "/webhook/url",
             "'x' is not http(s)://host[:port]/path without a user"},
        Case{R"("webhook":{"url":"http://x","events":["tile"]})", "/webhook/events/0",
             "'tile' is not one of state, warning, end"},
        Case{R"("retention_seconds":-1)", "/retention_seconds", "-1 is outside [0, 315576000]"},
        Case{R"("film":{"filter":{"type":"sinc"}})", "/film/filter/type",
             "Unknown value 'sinc'; expected one of: box, tent, gaussian, mitchell, "
             "blackman-harris"},
        Case{R"("film":{"layers":["albedo","heat"]})", "/film/layers/1",
             "Unknown value 'heat'; expected one of: beauty, albedo, normal, depth, object, "
             "instance, material, primitive, position, uv, motion, cryptomatte:object, "
             "cryptomatte:material, alpha, samples, variance, error, denoised, denoised_error, "
             "denoise_bias, denoise_bias_error, irradiance, bounce:N, bounce:N-, light:NAME, "
             "st:S,T, st:S,T:unweighted"},
        Case{R"("film":{"layers":["albedo","albedo"]})", "/film/layers/1",
             "'albedo' appears more than once"},
        Case{R"("film":{"layers":"albedo"})", "/film/layers",
             "expected an array of layer names, got a string"},
        Case{R"("estimator":{"roulette":{"type":"none","delta":1}})", "/estimator/roulette/delta",
             "applies only to type 'threshold'"},
        Case{R"("estimator":{"splitting":{"count":2}})", "/estimator/splitting/count",
             "applies only to type 'fixed'"},
        Case{R"("light_sampler":{"candidates":2})", "/light_sampler/candidates",
             "applies only to type 'ris'"},
        Case{R"("integrator":{"photons":4096})", "/integrator/photons",
             "applies only to type 'photon-map', 'sppm'"},
        Case{R"("integrator":{"type":"bdpt","radius_m":1})", "/integrator/radius_m",
             "applies only to type 'photon-map', 'sppm'"},
        Case{R"("integrator":{"type":"sppm","final_gather":2})", "/integrator/final_gather",
             "applies only to type 'photon-map'"},
        Case{R"("integrator":{"type":"photon-map","alpha":0.5})", "/integrator/alpha",
             "applies only to type 'sppm'"},
        Case{R"("integrator":{"type":"path","records":100})", "/integrator/records",
             "applies only to type 'irradiance-cache'"},
        Case{R"("integrator":{"type":"irradiance-cache","tolerance":0})", "/integrator/tolerance",
             "0 is outside [0.05, 1]"},
        Case{R"("integrator":{"type":"irradiance-cache","rays":15})", "/integrator/rays",
             "15 is outside [16, 65536]"},
        Case{R"("integrator":{"type":"sppm","alpha":2})", "/integrator/alpha",
             "2 is outside [0.1, 1]"},
        Case{R"("light_sampler":{"type":"ris","block":2})", "/light_sampler/block",
             "applies only to type 'restir'"},
        Case{R"("light_sampler":{"history":2})", "/light_sampler/history",
             "applies only to type 'restir'"},
        Case{R"("light_sampler":{"type":"restir","block":3,"history":8})", "/light_sampler/history",
             "8 passes of 3 x 3 pixels are 72 paths that share samples; at most 64 can"},
        Case{R"("light_sampler":{"type":"restir","candidates":2})", "/light_sampler/candidates",
             "applies only to type 'ris'"},
        Case{R"("light_sampler":{"type":"restir"},"estimator":{"strategy":"bsdf"})",
             "/light_sampler/type",
             "light sampler 'restir' cannot be combined with strategies 'bsdf', 'cosine' and "
             "'uniform'"},
        Case{R"("light_sampler":{"type":"restir"},"estimator":{"splitting":{"type":"fixed"}})",
             "/estimator/splitting/type",
             "splitting cannot be combined with light sampler 'restir', which gives each path one "
             "light "
             "sample"},
        Case{R"("light_sampler":{"type":"restir"},)"
             R"("estimator":{"control_variate":{"type":"analytic"}})",
             "/estimator/control_variate/type",
             "a control variate cannot be combined with light sampler 'restir': a neighbour's "
             "sample does not cancel "
             "the term subtracted for a path's own sample"},
        Case{R"("estimator":{"mis":{"type":"optimal"}},"light_sampler":{"type":"restir"})",
             "/estimator/mis/type",
             "'optimal' cannot be combined with light sampler 'restir', whose density is unknown"},
        Case{R"("estimator":{"mis":{"type":"balance","exponent":2}})", "/estimator/mis/exponent",
             "applies only to type 'power'"},
        Case{R"("estimator":{"strategy":"light","mis":{"type":"balance"}})", "/estimator/mis",
             "weights cannot be combined with a strategy other than 'mis'"},
        Case{R"("preview_key":"k")", "/preview_key", "applies only to class 'preview'"},
        Case{
            R"("cameras":{})", "/cameras",
            "Unknown field; expected one of: scene, name, labels, priority, seed, camera, variant, "
            "time_seconds, shutter_seconds, motion_seconds, "
            "medium, class, preview_key, environment, background, ground, film, integrator, "
            "estimator, sampler, light_sampler, adaptive, meter, units, spectral, stop, "
            "denoise, webhook, retention_seconds"}));

INSTANTIATE_TEST_SUITE_P(
    Camera, JobRefusal,
    testing::Values(
        Case{R"("camera":null)", "/camera", "expected an object, got null"},
        Case{R"("camera":{"name":"a","index":0})", "/camera/index",
             "name and index both select a camera of the file; give only one"},
        Case{R"("camera":{"position":[0,0,1]})", "/camera/target", "is required with position"},
        Case{R"("camera":{"target":[0,0,1]})", "/camera/position", "is required with target"},
        Case{R"("camera":{"position":[0,0,1],"target":[0,0,1]})", "/camera/target",
             "equals position"},
        Case{R"("camera":{"position":[0,5,0],"target":[0,0,0]})", "/camera/up",
             "is [0, 1, 0], which is parallel to the direction from position to "
             "target; give another"},
        Case{R"("camera":{"position":[0,0,0],"target":[1,2,3],"up":[-2,-4,-6]})", "/camera/up",
             "is parallel to the direction from position to target"},
        Case{R"("camera":{"orbit":{"phi_degrees":181}})", "/camera/orbit/phi_degrees",
             "181 is outside [0, 180]"},
        Case{R"("camera":{"orbit":{"radius":"far"}})", "/camera/orbit/radius",
             "expected 'auto' or a number, got a string"},
        Case{R"("camera":{"orbit":{},"position":[0,0,0],"target":[1,2,3]})", "/camera/orbit",
             "sets the camera's position; give either orbit or position and target"},
        Case{R"("camera":{"up":[0,0,0]})", "/camera/up", "is the zero vector"},
        Case{R"("camera":{"position":[0,0]})", "/camera/position",
             "expected an array of 3 numbers, got 2 elements"},
        Case{R"("camera":{"position":[0,"0",0]})", "/camera/position/1",
             "expected a number, got a string"},
        Case{R"("camera":{"position":[0,1e10,0]})", "/camera/position/1",
             "10000000000 is outside [-1000000000, 1000000000]"},
        Case{R"("camera":{"vertical_fov_degrees":180})", "/camera/vertical_fov_degrees",
             "180 is outside (0, 180)"},
        Case{R"("camera":{"vertical_fov_degrees":0})", "/camera/vertical_fov_degrees",
             "0 is outside (0, 180)"},
        Case{R"("camera":{"aperture_radius":-1})", "/camera/aperture_radius",
             "-1 is outside [0, 1000000000]"},
        Case{R"("camera":{"focus_distance":0})", "/camera/focus_distance",
             "0 is outside (0, 1000000000]"},
        Case{R"("camera":{"index":-1})", "/camera/index", "-1 is outside [0, 65535]"}));

INSTANTIATE_TEST_SUITE_P(
    Film, JobRefusal,
    testing::Values(
        Case{R"("film":{"crop":{"x":900,"y":0,"width":61,"height":1}})", "/film/crop",
             "covers x = 900 to 961, outside the film's width of 960"},
        Case{R"("film":{"crop":{"x":0,"y":539,"width":1,"height":2}})", "/film/crop",
             "covers y = 539 to 541, outside the film's height of 540"},
        Case{R"("film":{"crop":{"x":0,"y":0,"width":0,"height":1}})", "/film/crop/width",
             "0 is outside [1, 16384]"},
        Case{R"("film":{"crop":{"x":0,"y":0,"width":5}})", "/film/crop/height", "is required"},
        Case{R"("film":{"crop":{"x":-1,"y":0,"width":1,"height":1}})", "/film/crop/x",
             "-1 is outside [0, 16383]"},
        Case{R"("film":{"crop":[0,0,1,1]})", "/film/crop", "expected an object, got an array"}));

INSTANTIATE_TEST_SUITE_P(
    Environment, JobRefusal,
    testing::Values(
        Case{R"("environment":"white")", "/environment", "expected an object, got a string"},
        Case{R"("environment":{"color":[1,-1,1]})", "/environment/color/1",
             "-1 is outside [0, 1000000000]"},
        Case{R"("environment":{"intensity":-0.5})", "/environment/intensity",
             "-0.5 is outside [0, 1000000000]"},
        Case{R"("environment":{"visible":1})", "/environment/visible",
             "expected true or false, got a number"},
        Case{R"("environment":{"asset":"sky.hdr"})", "/environment/asset",
             "'sky.hdr' is not an asset id (64 lower-case hex digits)"},
        Case{R"("environment":{"colour":[1,1,1]})", "/environment/colour",
             "Unknown field; expected one of: asset, preset, sun, color, intensity, "
             "rotation_degrees, "
             "visible"},
        Case{R"("environment":{"preset":"studio","sun":{"latitude":0,"longitude":0,)"
             R"("time":"2026-06-21T12:00:00Z"}})",
             "/environment/preset", "asset, preset and sun exclude each other; give only one"},
        Case{R"("environment":{"preset":"beach"})", "/environment/preset",
             "Unknown value 'beach'; expected one of: studio, tent, rim"},
        Case{R"("environment":{"sun":{"latitude":0,"longitude":0}})", "/environment/sun/time",
             "is required"},
        Case{R"("environment":{"sun":{"latitude":91,"longitude":0,)"
             R"("time":"2026-06-21T12:00:00Z"}})",
             "/environment/sun/latitude", "91 is outside [-90, 90]"},
        Case{R"("environment":{"sun":{"latitude":0,"longitude":0,"time":"noon"}})",
             "/environment/sun/time",
             "'noon' is not an RFC 3339 time such as 2026-06-21T12:00:00+02:00"},
        // Midnight on the sun's meridian in June: as low as the declination permits.
        Case{R"("environment":{"sun":{"latitude":0,"longitude":0,)"
             R"("time":"2026-06-21T00:01:50Z"}})",
             "/environment/sun/time",
             "the sun is 66.6 degrees below the horizon at that time; the sky model covers only "
             "daytime"}));

INSTANTIATE_TEST_SUITE_P(
    Stage, JobRefusal,
    testing::Values(
        Case{R"("environment":{"visible":false},"background":{"type":"color"})",
             "/environment/visible", "false contradicts background type 'color'; give only one"},
        Case{R"("environment":{"visible":true},"background":{"type":"transparent"})",
             "/environment/visible",
             "true contradicts background type 'transparent'; give only one"},
        Case{R"("background":{"type":"blurred","color":[1,1,1]})", "/background/color",
             "applies only to type 'color'"},
        Case{R"("ground":{"height":1})", "/ground/height",
             "applies only to types 'catcher' and 'sweep'"},
        Case{R"("ground":{"type":"catcher","color":[2,0,0]})", "/ground/color/0",
             "2 is outside [0, 1]"},
        Case{R"("ground":{"type":"catcher"},"integrator":{"type":"bdpt"})", "/ground/type",
             "ground 'catcher' is not supported by integrator 'bdpt', but by 'path'"},
        Case{R"("ground":{"type":"catcher"},"estimator":{"strategy":"light"})",
             "/estimator/strategy",
             "a strategy other than 'mis' cannot be combined with ground 'catcher'"},
        Case{R"("ground":{"type":"catcher"},"light_sampler":{"type":"restir"})",
             "/light_sampler/type",
             "light sampler 'restir' cannot be combined with ground 'catcher'"},
        Case{R"("ground":{"type":"catcher"},"medium":{"scattering":[1,1,1]})", "/medium",
             "a medium cannot be combined with ground 'catcher'"},
        Case{R"("ground":{"type":"catcher"},"film":{"layers":["bounce:1"]})", "/film/layers/0",
             "layers bounce:N, light:NAME, st:S,T and irradiance cannot be combined with ground "
             "'catcher'"},
        Case{R"("ground":{"type":"catcher"},"spectral":true)", "/spectral",
             "spectral true cannot be combined with ground 'catcher'"}));

INSTANTIATE_TEST_SUITE_P(
    Stop, JobRefusal,
    testing::Values(
        Case{R"("stop":{})", "/stop",
             "has no rule; give samples_per_pixel, relative_error, denoised_error, meter_error, "
             "light_not_found, seconds, cpu_seconds or deadline"},
        Case{R"("stop":{"samples_per_pixel":null})", "/stop",
             "has no rule; give samples_per_pixel, relative_error, denoised_error, meter_error, "
             "light_not_found, seconds, cpu_seconds or deadline"},
        Case{R"("stop":{"confidence":0.9})", "/stop",
             "has no rule; give samples_per_pixel, relative_error, denoised_error, meter_error, "
             "light_not_found, seconds, cpu_seconds or deadline"},
        Case{R"("stop":null)", "/stop", "expected an object, got null"},
        Case{R"("stop":{"samples_per_pixel":0})", "/stop/samples_per_pixel",
             "0 is outside [1, 65536]"},
        Case{R"("stop":{"samples_per_pixel":65537})", "/stop/samples_per_pixel",
             "65537 is outside [1, 65536]"},
        Case{R"("stop":{"relative_error":0})", "/stop/relative_error", "0 is outside [1e-05, 1]"},
        Case{R"("stop":{"relative_error":5})", "/stop/relative_error", "5 is outside [1e-05, 1]"},
        Case{R"("stop":{"denoised_error":0})", "/stop/denoised_error", "0 is outside [1e-05, 1]"},
        Case{R"("stop":{"denoised_error":0.1},"denoise":{"type":"none"})", "/stop/denoised_error",
             "the job's denoise.type is 'none'"},
        Case{R"("stop":{"denoised_error":0.1},"integrator":{"type":"photon-map"})",
             "/stop/denoised_error",
             "the error of denoised images of integrator 'photon-map' is unknown: its images are "
             "biased, and their halves show only the noise; give relative_error, samples_per_pixel "
             "or seconds"},
        Case{R"("stop":{"meter_error":0.1})", "/stop/meter_error", "the job has no meter"},
        Case{R"("stop":{"light_not_found":0})", "/stop/light_not_found", "0 is outside [1e-05, 1]"},
        Case{R"("stop":{"light_not_found":0.1},"shutter_seconds":0.1)", "/stop/light_not_found",
             "light that was not found has no bound with motion blur; give relative_error, "
             "samples_per_pixel or seconds"},
        Case{R"("stop":{"relative_error":0.1,"confidence":1})", "/stop/confidence",
             "1 is outside [0.5, 0.9999]"},
        Case{R"("stop":{"relative_error":0.1,"scope":"tile"})", "/stop/scope",
             "Unknown value 'tile'; expected one of: image, worst_tile"},
        Case{R"("stop":{"seconds":1,"scope":"worst_tile"})", "/stop/scope",
             "applies only to relative_error"},
        Case{R"("stop":{"seconds":0})", "/stop/seconds", "0 is outside (0, 604800]"},
        Case{R"("stop":{"seconds":604801})", "/stop/seconds", "604801 is outside (0, 604800]"},
        Case{R"("stop":{"deadline":"tomorrow"})", "/stop/deadline",
             "'tomorrow' is not an RFC 3339 time such as 2026-01-31T12:00:00Z"},
        Case{R"("stop":{"deadline":1767225600})", "/stop/deadline",
             "expected a string, got a number"}));

TEST(ParseJob, RequiresAScene) {
  const auto parsed = api::parse_job("{}");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 422);
  EXPECT_EQ(parsed.problem().errors, (std::vector<api::FieldError>{{"/scene", "is required"}}));
}

TEST(ParseJob, RequiresAnObject) {
  const auto parsed = api::parse_job("[]");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors,
            (std::vector<api::FieldError>{{"", "expected an object, got an array"}}));
}

TEST(ParseJob, ReportsAllFaultsAtOnce) {
  const auto parsed =
      api::parse_job(R"({"scene":"","seed":-1,"film":{"width":0,"colour":1},"stop":{"seconds":-1,)"
                     R"("confidence":2}})");
  ASSERT_FALSE(parsed);
  std::vector<std::string> pointers;
  for (const auto& error : parsed.problem().errors) {
    pointers.push_back(error.pointer);
  }
  EXPECT_EQ(pointers, (std::vector<std::string>{"/scene", "/seed", "/film/colour", "/film/width",
                                                "/stop/confidence", "/stop/seconds"}));
}

TEST(ParseJob, AnswersATooLargeFilmWith413) {
  const auto parsed = api::parse_job(R"({"scene":"x","film":{"width":16384,"height":4096}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 413);
  EXPECT_EQ(parsed.problem().errors,
            (std::vector<api::FieldError>{
                {"/film", "16384 x 4096 is 67108864 pixels; at most 64000000 are allowed"}}));
  EXPECT_TRUE(api::parse_job(R"({"scene":"x","film":{"width":8000,"height":8000}})"));
}

TEST(ParseJob, AnswersATooLargeFilmWithOtherFaultsWith422) {
  const auto parsed = api::parse_job(
      R"({"scene":"x","camera":{"target":[0,0,0]},"film":{"width":16384,"height":16384}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 422);
  EXPECT_EQ(parsed.problem().errors.size(), 2U);
}

TEST(ParseJob, AnswersATooLargeBodyWith413) {
  EXPECT_EQ(api::parse_job(std::string((1U << 20U) + 1, ' ')).problem().status, 413);
}

TEST(ParseJob, LimitsTheAnswerForManyFaults) {
  std::string body = "{";
  for (int i = 0; i < 50000; ++i) {
    body += (i == 0 ? "\"x" : ",\"x") + std::to_string(i) + "\":1";
  }
  const auto parsed = api::parse_job(body + "}");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors.size(), 32U);
}

TEST(CheckOptions, RefusesOptionsThatTheIntegratorDoesNotUse) {
  const auto parsed = api::parse_job(R"({"scene":"x","estimator":{"strategy":"bsdf"},)"
                                     R"("integrator":{"type":"direct","max_depth":3}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(
      parsed.problem().errors,
      (std::vector<api::FieldError>{
          {"/integrator/max_depth",
           "is not supported by integrator 'direct', but by 'path', 'light-trace', 'bdpt', 'mlt', "
           "'photon-map', 'sppm', 'irradiance-cache', 'auto'"},
          {"/estimator/strategy", "is not supported by integrator 'direct', but by 'path'"}}));
}

TEST(CheckOptions, AcceptsTheOnlyValueOfAnOptionThatTheIntegratorDoesNotUse) {
  EXPECT_TRUE(api::parse_job(R"({"scene":"x","integrator":{"type":"direct","max_depth":1}})"));
}

}  // namespace
