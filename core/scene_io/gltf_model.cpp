#include "core/scene_io/gltf_model.h"

#include <algorithm>
#include <exception>
#include <new>
#include <vector>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_tables.h"

namespace core {
namespace {

// Denies tinygltf file access: every callback refuses.
tinygltf::FsCallbacks no_files() {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string&, void*) { return false; };
  callbacks.ExpandFilePath = [](const std::string&, void*) { return std::string(); };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&,
                               void*) { return false; };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                                void*) { return false; };
  return callbacks;
}

bool no_images(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*,
               int, void*) {
  return false;
}

// Checks that every node has at most one parent and that there is no cycle.
Status check_forest(const tinygltf::Model& model) {
  std::vector<int> parent(model.nodes.size(), -1);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const auto& children = model.nodes[i].children;
    for (std::size_t c = 0; c < children.size(); ++c) {
      int& of_child = parent[static_cast<std::size_t>(children[c])];
      if (of_child >= 0) {
        return invalid(pointer_of("nodes", i) + "/children/" + std::to_string(c),
                       "node " + std::to_string(children[c]) + " is already a child of node " +
                           std::to_string(of_child));
      }
      of_child = static_cast<int>(i);
    }
  }
  // With one parent each, a cycle is a set of nodes not reachable from a root.
  std::vector<int> open;
  for (std::size_t i = 0; i < parent.size(); ++i) {
    if (parent[i] < 0) {
      open.push_back(static_cast<int>(i));
    }
  }
  std::vector<bool> reached(model.nodes.size(), false);
  while (!open.empty()) {
    const auto node = static_cast<std::size_t>(open.back());
    open.pop_back();
    reached[node] = true;
    open.insert(open.end(), model.nodes[node].children.begin(), model.nodes[node].children.end());
  }
  const auto lost = std::find(reached.begin(), reached.end(), false);
  if (lost != reached.end()) {
    return invalid(pointer_of("nodes", static_cast<std::size_t>(lost - reached.begin())),
                   "the node is among its own descendants");
  }
  return ok_status();
}

Status check_nodes(const tinygltf::Model& model) {
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const tinygltf::Node& node = model.nodes[i];
    if (node.skin >= 0 && node.mesh < 0) {
      return invalid(pointer_of("nodes", i), "a node with a skin needs a mesh");
    }
  }
  return check_forest(model);
}

Status check_parts(const tinygltf::Model& model) {
  for (std::size_t i = 0; i < model.cameras.size(); ++i) {
    const tinygltf::Camera& camera = model.cameras[i];
    const bool orthographic = camera.type == "orthographic";
    if (orthographic && (camera.orthographic.xmag == 0 || camera.orthographic.ymag == 0)) {
      return invalid(pointer_of("cameras", i),
                     "the camera has no orthographic object with xmag and ymag other than 0");
    }
    if (!orthographic && camera.perspective.yfov <= 0) {
      return invalid(pointer_of("cameras", i), "the camera has no perspective object");
    }
  }
  for (std::size_t i = 0; i < model.lights.size(); ++i) {
    const tinygltf::Light& light = model.lights[i];
    if (light.type == "spot" && !(light.spot.innerConeAngle < light.spot.outerConeAngle)) {
      return invalid("/extensions/KHR_lights_punctual/lights/" + std::to_string(i) + "/spot",
                     "innerConeAngle must be less than outerConeAngle");
    }
  }
  for (std::size_t i = 0; i < model.animations.size(); ++i) {
    const tinygltf::Animation& animation = model.animations[i];
    for (std::size_t c = 0; c < animation.channels.size(); ++c) {
      if (static_cast<std::size_t>(animation.channels[c].sampler) >= animation.samplers.size()) {
        return invalid(pointer_of("animations", i) + "/channels/" + std::to_string(c) + "/sampler",
                       std::to_string(animation.channels[c].sampler) + " names none of the " +
                           std::to_string(animation.samplers.size()) + " samplers");
      }
    }
  }
  return ok_status();
}

}  // namespace

Result<tinygltf::Model> parse_model(const std::string& model_json) {
  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(no_files());
  loader.SetImageLoader(no_images, nullptr);
  tinygltf::Model model;
  std::string error;
  std::string warning;
  try {
    if (!loader.LoadASCIIFromString(&model, &error, &warning, model_json.data(),
                                    static_cast<unsigned int>(model_json.size()), "",
                                    tinygltf::NO_REQUIRE)) {
      return invalid("", error.empty() ? "the glTF document cannot be read" : error);
    }
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    return invalid("", std::string("the glTF document cannot be read: ") + problem.what());
  }
  if (auto status = check_nodes(model); !status) {
    return status.error();
  }
  if (auto status = check_parts(model); !status) {
    return status.error();
  }
  return model;
}

const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() ? nullptr : &it->second;
}

float value_number(const tinygltf::Value& object, const char* name, float otherwise) {
  return object.Has(name) && object.Get(name).IsNumber()
             ? static_cast<float>(object.Get(name).GetNumberAsDouble())
             : otherwise;
}

int value_integer(const tinygltf::Value& object, const char* name, int otherwise) {
  return object.Has(name) && object.Get(name).IsNumber() ? object.Get(name).GetNumberAsInt()
                                                         : otherwise;
}

const std::vector<tinygltf::Value>& value_array(const tinygltf::Value& value) {
  return value.Get<tinygltf::Value::Array>();
}

Rgb value_rgb(const tinygltf::Value& object, const char* name, Rgb otherwise) {
  if (!object.Has(name) || object.Get(name).ArrayLen() < 3) {
    return otherwise;
  }
  const auto& array = value_array(object.Get(name));
  const auto channel = [&array](std::size_t i) {
    return static_cast<float>(array[i].GetNumberAsDouble());
  };
  return {channel(0), channel(1), channel(2)};
}

}  // namespace core
