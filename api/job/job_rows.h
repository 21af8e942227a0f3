/// Members of the job request that are more than one number, word or triple: reading, printing and
/// schema of each. Rows of the table in api/job/job_spec.cpp.
#pragma once

#include <string>

#include "api/job/job_spec.h"
#include "api/json/faults.h"
#include "api/json/json.h"

namespace api {

void read_labels(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_labels(const JobSpec& spec, Json& object);
Json labels_schema(const JobSpec& defaults);

void read_environment(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_environment(const JobSpec& spec, Json& object);
Json environment_schema(const JobSpec& defaults);

void read_background(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_background(const JobSpec& spec, Json& object);
Json background_schema(const JobSpec& defaults);

void read_ground(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_ground(const JobSpec& spec, Json& object);
Json ground_schema(const JobSpec& defaults);

/// Sets defaults of background and denoising that depend on omitted members.
void set_stage_defaults(const Json& request, JobSpec& spec);
/// Checks rules between environment, background, ground and other members.
void check_stage(const Json& request, const JobSpec& spec, Faults& faults);

void read_orbit(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_orbit(const JobSpec& spec, Json& object);
Json orbit_schema(const JobSpec& defaults);

void read_shift(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_shift(const JobSpec& spec, Json& object);
Json shift_schema(const JobSpec& defaults);

void read_pose(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_pose(const JobSpec& spec, Json& object);
Json pose_schema(const JobSpec& defaults);

void read_distortion(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_distortion(const JobSpec& spec, Json& object);
Json distortion_schema(const JobSpec& defaults);
/// Also for answers.
Json distortion_json(const core::DistortionSettings& distortion);
Json distortion_shape();

void read_webhook(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_webhook(const JobSpec& spec, Json& object);
Json webhook_schema(const JobSpec& defaults);

void read_crop(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_crop(const JobSpec& spec, Json& object);
Json crop_schema(const JobSpec& defaults);

void read_medium(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_medium(const JobSpec& spec, Json& object);
Json medium_schema(const JobSpec& defaults);

void read_meter(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_meter(const JobSpec& spec, Json& object);
Json meter_schema(const JobSpec& defaults);

/// Returns the schema of a layer's name.
Json layer_schema();
/// Returns the fault of a value that names no layer.
std::string unknown_layer(const Json& value);
void read_layers(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
void print_layers(const JobSpec& spec, Json& object);
Json layers_schema(const JobSpec& defaults);

void read_replicates(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults);
Json replicates_schema(const JobSpec& defaults);
void read_first_replicate(const Json& value, JobSpec& spec, const std::string& pointer,
                          Faults& faults);
Json first_replicate_schema(const JobSpec& defaults);

}  // namespace api
