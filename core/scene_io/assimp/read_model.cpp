#include "core/scene_io/assimp/read_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <new>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/ObjMaterial.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <nlohmann/json.hpp>

#include "core/base/file_names.h"
#include "core/base/text.h"
#include "core/color/srgb.h"
#include "core/scene_io/assimp/check_ply.h"
#include "core/scene_io/assimp/mend_mtl.h"
#include "core/scene_io/assimp/mend_obj.h"
#include "core/scene_io/assimp/mend_stl.h"
#include "core/scene_io/assimp/read_3mf.h"
#include "core/scene_io/assimp/text_encoding.h"
#include "core/scene_io/assimp/words.h"
#include "core/scene_io/glb_writer.h"
#include "core/scene_io/gltf_json.h"

namespace core {
namespace {

constexpr int kF32 = 5126;
constexpr int kU32 = 5125;
constexpr const char* kNoTriangles = "it has no triangles";
constexpr double kGrey = 0.8;   ///< without a colour: as Blender's new materials
constexpr int kDepthMost = 64;  ///< of nodes
constexpr std::size_t kNodesMost = 1'000'000;

/// What files of a format mean where they do not say so. Axes of STL, OBJ and PLY: as Blender's
/// importers assume. Millimetres of STL: as slicers read it. Colours are stored as they are shown,
/// except those of OBJ's materials, which are linear as Blender's importer reads them.
struct Convention {
  std::string_view extension;
  std::string_view note;
  double metres = 1;
  bool is_z_up = false;
  bool has_materials = false;
  bool has_linear_colors = false;
};
constexpr std::array kConventions = {
    Convention{"stl", "STL has neither unit nor axes: read as millimetres, z up.", 0.001, true},
    Convention{"obj", "OBJ has no unit: read as metres, y up.", 1, false, true, true},
    Convention{"ply", "PLY has neither unit nor axes: read as metres, z up.", 1, true},
    Convention{"3mf", "", 0.001, true, true},
};

/// Returns how many of their last parts two paths share, without regard to case, as Windows and
/// macOS find files.
std::size_t shared_parts(std::string_view a, std::string_view b) {
  std::size_t count = 0;
  while (!a.empty() && !b.empty() && equal_ignoring_case(last_part(a), last_part(b))) {
    ++count;
    a.remove_suffix(std::min(last_part(a).size() + 1, a.size()));
    b.remove_suffix(std::min(last_part(b).size() + 1, b.size()));
  }
  return count;
}

/// Files in memory, by the last parts of their names.
class Files : public Assimp::IOSystem {
 public:
  explicit Files(const std::vector<ModelFile>& files) : files_(files) {}
  bool Exists(const char* name) const override { return find(name) != nullptr; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* /*mode*/) override {
    const ModelFile* file = find(name);
    if (file == nullptr) {
      missing_.emplace(last_part(name));
      return nullptr;
    }
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(file->content.data()),
                                      file->content.size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

  /// Of several files with a name, the one whose folders are most like those of the name.
  const ModelFile* find(std::string_view name) const {
    const ModelFile* best = nullptr;
    std::pair<std::size_t, bool> best_likeness = {0, false};
    for (const ModelFile& file : files_) {
      const std::pair likeness = {shared_parts(file.name, name),
                                  last_part(file.name) == last_part(name)};
      if (likeness.first > 0 && (best == nullptr || likeness > best_likeness)) {
        best = &file;
        best_likeness = likeness;
      }
    }
    return best;
  }
  const std::set<std::string>& missing() const { return missing_; }

 private:
  const std::vector<ModelFile>& files_;
  std::set<std::string> missing_;
};

/// Units of the 3MF Core Specification, 3.4.
std::optional<double> metres_of(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {{{"micron", 1e-6},
                                                                          {"millimeter", 0.001},
                                                                          {"centimeter", 0.01},
                                                                          {"inch", 0.0254},
                                                                          {"foot", 0.3048},
                                                                          {"meter", 1}}};
  const auto* found = std::find_if(kUnits.begin(), kUnits.end(),
                                   [&](const auto& row) { return row.first == unit; });
  return found == kUnits.end() ? std::nullopt : std::optional(found->second);
}

/// Returns text with U+FFFD for bytes that are not UTF-8: names are in any encoding.
std::string dumped(const GltfJson& json) {
  return json.dump(-1, ' ', false, GltfJson::error_handler_t::replace);
}

bool is_finite(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

class Writer {
 public:
  /// is_joined: equal vertices are one already.
  Writer(const aiScene& scene, const Convention& convention, double metres, bool is_joined,
         Files& files, std::vector<std::string>& notes)
      : scene_(scene),
        convention_(convention),
        metres_(metres),
        is_joined_(is_joined),
        files_(files),
        notes_(notes) {}

  /// Returns an error text.
  std::string write() {
    for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[i];
      if (!std::all_of(mesh.mVertices, mesh.mVertices + mesh.mNumVertices, is_finite)) {
        return std::string("a coordinate of '") + mesh.mName.C_Str() + "' is not a finite number";
      }
      meshes_.push_back(add_mesh(mesh));
    }
    aiMatrix4x4 root;
    const auto s = static_cast<ai_real>(metres_);
    root = convention_.is_z_up ? aiMatrix4x4(s, 0, 0, 0, 0, 0, s, 0, 0, -s, 0, 0, 0, 0, 0, 1)
                               : aiMatrix4x4(s, 0, 0, 0, 0, s, 0, 0, 0, 0, s, 0, 0, 0, 0, 1);
    if (!add_nodes(*scene_.mRootNode, root, 0)) {
      return "its objects are nested deeper than " + std::to_string(kDepthMost) +
             " levels, or are more than " + std::to_string(kNodesMost);
    }
    return nodes_ > 0 ? "" : kNoTriangles;
  }
  /// notes: kept in the file, so that the same file has the same ones.
  Bytes finish(const std::vector<std::string>& notes) {
    const GltfJson extras = {{"converted", notes}};
    writer_.set("extras", dumped(extras));
    return writer_.finish();
  }

 private:
  double color(double value) const {
    const double within = std::clamp(value, 0.0, 1.0);
    return convention_.has_linear_colors ? within : srgb_decoded(within);
  }

  template <typename Color>
  std::array<double, 3> linear(const Color& c) const {
    return {color(static_cast<double>(c.r)), color(static_cast<double>(c.g)),
            color(static_cast<double>(c.b))};
  }

  /// has_colors: of vertices, which are multiplied with the base colour.
  GltfJson material(const aiMaterial& from, bool has_colors) {
    std::array<double, 3> base = {kGrey, kGrey, kGrey};
    aiColor4D diffuse;
    // OBJ without materials has libassimp's grey, as those whose MTL is missing.
    const bool is_given = from.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == AI_SUCCESS &&
                          convention_.has_materials &&
                          (convention_.has_linear_colors || !is_made_up(from));
    float opacity = 1;
    from.Get(AI_MATKEY_OPACITY, opacity);
    if (is_given) {
      base = linear(diffuse);
      opacity *= diffuse.a > 0 ? diffuse.a : 1;  // libassimp's alpha of 3MF colours without one
    }
    float metallic = 0;
    from.Get(AI_MATKEY_METALLIC_FACTOR, metallic);
    float roughness = 0.6F;
    float shininess = 0;
    const bool has_roughness = from.Get(AI_MATKEY_ROUGHNESS_FACTOR, roughness) == AI_SUCCESS;
    if (!has_roughness && is_given && from.Get(AI_MATKEY_SHININESS, shininess) == AI_SUCCESS) {
      // As Blender's importer of OBJ.
      roughness = 1 - std::sqrt(std::clamp(shininess, 0.0F, 1000.0F) / 1000);
    }
    int illum = 2;
    from.Get(AI_MATKEY_OBJ_ILLUM, illum);
    const bool is_black = base == std::array{0.0, 0.0, 0.0};
    aiColor4D specular;
    const bool has_specular = from.Get(AI_MATKEY_COLOR_SPECULAR, specular) == AI_SUCCESS;
    if (illum == 3 && is_black && has_specular) {  // a mirror without diffuse light: a metal
      base = linear(specular);
      metallic = 1;
    }
    GltfJson extensions = GltfJson::object();
    const auto picture = texture(from, aiTextureType_DIFFUSE);
    if (base == std::array{0.0, 0.0, 0.0} && from.GetTextureCount(aiTextureType_DIFFUSE) > 0) {
      base.fill(picture ? 1 : kGrey);  // Programs that show the texture alone write 0.
    }
    if (has_colors) {
      base = {1, 1, 1};
    }
    if (illum == 6 || illum == 7) {
      roughness = has_roughness || shininess > 0 ? roughness : 0;
      add_glass(from, is_black, base, extensions);
    }
    GltfJson pbr = {{"metallicFactor", std::clamp(metallic, 0.0F, 1.0F)},
                    {"roughnessFactor", std::clamp(roughness, 0.0F, 1.0F)}};
    pbr["baseColorFactor"] = {base[0], base[1], base[2], std::clamp(opacity, 0.0F, 1.0F)};
    if (picture) {
      pbr["baseColorTexture"]["index"] = *picture;
    }
    GltfJson out = {{"pbrMetallicRoughness", std::move(pbr)}};
    out["name"] = std::string(from.GetName().C_Str());
    out["doubleSided"] = true;  // None of these formats has one side.
    if (opacity < 1) {
      out["alphaMode"] = "BLEND";
    }
    add_emission(from, out, extensions);
    for (const auto& [name, value] : extensions.items()) {
      writer_.use_extension(name);
      out["extensions"][name] = value;
    }
    if (const auto index = texture(from, aiTextureType_NORMALS)) {
      out["normalTexture"]["index"] = *index;
    }
    return out;
  }

  /// Whether libassimp has made the material, for objects without one.
  static bool is_made_up(const aiMaterial& from) {
    return std::string_view(from.GetName().C_Str()) == AI_DEFAULT_MATERIAL_NAME;
  }

  void add_emission(const aiMaterial& from, GltfJson& out, GltfJson& extensions) {
    aiColor3D emission;
    from.Get(AI_MATKEY_COLOR_EMISSIVE, emission);
    const auto glow = texture(from, aiTextureType_EMISSIVE);
    if (glow && emission.IsBlack()) {
      emission = {1, 1, 1};
    }
    if (!emission.IsBlack()) {
      const float strength = std::max({1.0F, emission.r, emission.g, emission.b});
      out["emissiveFactor"] = linear(emission * (1 / strength));
      if (strength > 1) {
        extensions["KHR_materials_emissive_strength"]["emissiveStrength"] = strength;
      }
    }
    if (glow) {
      out["emissiveTexture"]["index"] = *glow;
    }
  }

  /// illum 6 and 7: "refraction on". As solid glass of the colour of the filter, or of its own.
  void add_glass(const aiMaterial& from, bool is_black, std::array<double, 3>& base,
                 GltfJson& extensions) const {
    aiColor3D filter{1, 1, 1};
    from.Get(AI_MATKEY_COLOR_TRANSPARENT, filter);
    float ior = 1.5F;
    from.Get(AI_MATKEY_REFRACTI, ior);
    if (is_black) {
      base = {color(static_cast<double>(filter.r)), color(static_cast<double>(filter.g)),
              color(static_cast<double>(filter.b))};
    }
    extensions["KHR_materials_transmission"]["transmissionFactor"] = 1;
    extensions["KHR_materials_volume"]["thicknessFactor"] = 1;
    extensions["KHR_materials_ior"]["ior"] = ior > 1 ? ior : 1.5F;
  }

  /// Adds a texture with its file's bytes.
  std::optional<int> texture(const aiMaterial& from, aiTextureType type) {
    aiString path;
    if (from.GetTexture(type, 0, &path) != AI_SUCCESS) {
      return std::nullopt;
    }
    const auto [known, is_new] = textures_.try_emplace(path.C_Str());
    if (!is_new) {
      return known->second;
    }
    const std::string name(last_part(path.C_Str()));
    const ModelFile* const file = files_.find(path.C_Str());
    if (file == nullptr) {
      const bool is_inner = path.length > 0 && path.C_Str()[0] == '*';  // in a 3MF
      notes_.push_back("The texture " + name +
                       (is_inner ? " of the 3MF is left out." : " is missing and left out."));
      return std::nullopt;
    }
    const std::string_view bytes = text_of(file->content);
    const char* const mime = bytes.starts_with("\x89PNG")        ? "image/png"
                             : bytes.starts_with("\xFF\xD8\xFF") ? "image/jpeg"
                                                                 : nullptr;
    if (mime == nullptr) {
      notes_.push_back("The texture " + name + " is neither PNG nor JPEG and left out.");
      return std::nullopt;
    }
    const auto [made, is_unmade] = pictures_.try_emplace(file, 0);
    if (is_unmade) {
      const GltfJson image = {
          {"bufferView", writer_.add_view(file->content)}, {"mimeType", mime}, {"name", name}};
      const GltfJson entry = {{"source", writer_.add("images", dumped(image))}};
      made->second = writer_.add("textures", dumped(entry));
    }
    known->second = made->second;
    return known->second;
  }

  template <std::size_t kCount, typename Get>
  int accessor(std::size_t count, std::string_view type, const Get& get, bool has_bounds = false) {
    std::vector<float> values;
    values.reserve(count * kCount);
    std::array<float, kCount> least;
    std::array<float, kCount> most;
    least.fill(std::numeric_limits<float>::infinity());
    most.fill(-std::numeric_limits<float>::infinity());
    for (unsigned i = 0; i < count; ++i) {
      const std::array<float, kCount> value = get(i);
      for (std::size_t c = 0; c < kCount; ++c) {
        least[c] = std::min(least[c], value[c]);
        most[c] = std::max(most[c], value[c]);
        values.push_back(value[c]);
      }
    }
    const GltfJson bounds =
        has_bounds ? GltfJson{{"min", least}, {"max", most}} : GltfJson::object();
    return writer_.add_accessor(std::as_bytes(std::span(values)), kF32, type, count, bounds.dump());
  }

  /// Returns the mesh's index; -1 if it has no triangles.
  int add_mesh(const aiMesh& mesh) {
    std::vector<std::uint32_t> indices;
    indices.reserve(std::size_t{3} * mesh.mNumFaces);
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices == 3) {
        indices.insert(indices.end(), face.mIndices, face.mIndices + 3);
      }
    }
    if (indices.empty()) {
      return -1;
    }
    const std::vector<unsigned> kept = is_joined_ ? all(mesh) : join(mesh, indices);
    const std::size_t count = kept.size();
    const auto vector = [](const aiVector3D& v) { return std::array{v.x, v.y, v.z}; };
    GltfJson attributes;
    attributes["POSITION"] = accessor<3>(
        count, "VEC3", [&](unsigned i) { return vector(mesh.mVertices[kept[i]]); }, true);
    if (mesh.HasNormals()) {
      attributes["NORMAL"] =
          accessor<3>(count, "VEC3", [&](unsigned i) { return vector(mesh.mNormals[kept[i]]); });
    }
    if (mesh.HasTextureCoords(0)) {
      attributes["TEXCOORD_0"] = accessor<2>(count, "VEC2", [&](unsigned i) {
        const aiVector3D& uv = mesh.mTextureCoords[0][kept[i]];
        return std::array{uv.x, 1 - uv.y};  // theirs begins at the bottom
      });
    }
    const bool is_given =
        convention_.has_materials && !is_made_up(*scene_.mMaterials[mesh.mMaterialIndex]);
    const bool has_colors = shows_colors(mesh, is_given);
    if (has_colors) {
      attributes["COLOR_0"] = accessor<4>(count, "VEC4", [&](unsigned i) {
        const aiColor4D& c = mesh.mColors[0][kept[i]];
        const auto linear = [](float value) {
          return static_cast<float>(srgb_decoded(std::clamp(static_cast<double>(value), 0.0, 1.0)));
        };
        return std::array{linear(c.r), linear(c.g), linear(c.b), c.a};
      });
    }
    const int index_accessor =
        writer_.add_accessor(std::as_bytes(std::span(indices)), kU32, "SCALAR", indices.size());
    GltfJson primitive = {{"attributes", std::move(attributes)}, {"indices", index_accessor}};
    primitive["material"] =
        has_colors && !is_given ? white() : material_index(mesh.mMaterialIndex, has_colors);
    const GltfJson out = {{"name", std::string(mesh.mName.C_Str())},
                          {"primitives", GltfJson::array({std::move(primitive)})}};
    return writer_.add("meshes", dumped(out));
  }

  static std::vector<unsigned> all(const aiMesh& mesh) {
    std::vector<unsigned> out(mesh.mNumVertices);
    std::iota(out.begin(), out.end(), 0U);
    return out;
  }

  /// Returns the first ones of equal vertices, of those that the indices name, and changes the
  /// indices to theirs.
  static std::vector<unsigned> join(const aiMesh& mesh, std::vector<std::uint32_t>& indices) {
    using Vertex = std::array<float, 12>;
    const auto vertex = [&](unsigned i) {
      const aiVector3D& p = mesh.mVertices[i];
      const aiVector3D n = mesh.HasNormals() ? mesh.mNormals[i] : aiVector3D();
      const aiVector3D uv = mesh.HasTextureCoords(0) ? mesh.mTextureCoords[0][i] : aiVector3D();
      const aiColor4D c = mesh.HasVertexColors(0) ? mesh.mColors[0][i] : aiColor4D();
      return Vertex{p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y, c.r, c.g, c.b, c.a};
    };
    std::vector<unsigned> order(indices.begin(), indices.end());
    std::sort(order.begin(), order.end());
    order.erase(std::unique(order.begin(), order.end()), order.end());
    // By bytes: NaN has no order.
    const auto compare = [&](unsigned i, unsigned j) {
      const Vertex a = vertex(i);
      const Vertex b = vertex(j);
      return std::memcmp(a.data(), b.data(), sizeof(Vertex));
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](unsigned i, unsigned j) { return compare(i, j) < 0; });
    std::vector<unsigned> firsts(mesh.mNumVertices);
    std::vector<unsigned> kept;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool is_first = i == 0 || compare(order[i - 1], order[i]) != 0;
      firsts[order[i]] = is_first ? order[i] : firsts[order[i - 1]];
      if (is_first) {
        kept.push_back(order[i]);
      }
    }
    std::sort(kept.begin(), kept.end());
    for (std::uint32_t& index : indices) {
      const auto place = std::lower_bound(kept.begin(), kept.end(), firsts[index]);
      index = static_cast<std::uint32_t>(place - kept.begin());
    }
    return kept;
  }

  /// Whether a mesh is shown in the colours of its vertices. Scans have these beside textures,
  /// which are finer. has_material: white vertices may be those without a colour: see mend_obj().
  bool shows_colors(const aiMesh& mesh, bool has_material) {
    if (!mesh.HasVertexColors(0)) {
      return false;
    }
    const aiColor4D* const colors = mesh.mColors[0];
    const auto is_white = [](const aiColor4D& c) { return c.r == 1 && c.g == 1 && c.b == 1; };
    if (has_material && std::all_of(colors, colors + mesh.mNumVertices, is_white)) {
      return false;
    }
    return !texture(*scene_.mMaterials[mesh.mMaterialIndex], aiTextureType_DIFFUSE);
  }

  /// Returns the index of a material, which is added on first use: libassimp adds one of its own.
  int material_index(unsigned number, bool has_colors) {
    const auto [known, is_new] = materials_.try_emplace({number, has_colors}, 0);
    if (is_new) {
      known->second =
          writer_.add("materials", dumped(material(*scene_.mMaterials[number], has_colors)));
    }
    return known->second;
  }

  /// Returns the material of meshes whose vertices have colours.
  int white() {
    if (!white_) {
      white_ = writer_.add("materials",
                           R"({"name":"vertex colours","doubleSided":true,)"
                           R"("pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.6}})");
    }
    return *white_;
  }

  bool add_nodes(const aiNode& node, const aiMatrix4x4& parent, int depth) {
    if (depth > kDepthMost) {
      return false;
    }
    const aiMatrix4x4 m = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const int mesh = meshes_[node.mMeshes[i]];
      if (mesh < 0) {
        continue;
      }
      if (++nodes_ > kNodesMost) {
        return false;
      }
      const GltfJson out = {{"name", std::string(node.mName.C_Str())},
                            {"mesh", mesh},
                            {"matrix",
                             {m.a1, m.b1, m.c1, m.d1, m.a2, m.b2, m.c2, m.d2, m.a3, m.b3, m.c3,
                              m.d3, m.a4, m.b4, m.c4, m.d4}}};
      writer_.add("nodes", dumped(out));
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) {
      if (!add_nodes(*node.mChildren[i], m, depth + 1)) {
        return false;
      }
    }
    return true;
  }

  const aiScene& scene_;
  const Convention& convention_;
  const double metres_;
  const bool is_joined_;
  Files& files_;
  std::vector<std::string>& notes_;
  GlbWriter writer_;
  std::vector<int> meshes_;
  std::map<std::string, std::optional<int>> textures_;  ///< by their paths
  std::map<const ModelFile*, int> pictures_;            ///< textures by their files
  std::map<std::pair<unsigned, bool>, int> materials_;
  std::optional<int> white_;
  std::size_t nodes_ = 0;
};

/// Rewrites and checks the first file; libassimp checks less. Returns an error text; empty: none.
std::string mend(const std::string& extension, std::vector<ModelFile>& files,
                 std::vector<std::string>& notes) {
  Bytes& content = files.front().content;
  if (extension == "ply") {
    make_utf8(content);
    return check_ply(content, notes);
  }
  return extension == "obj"   ? mend_obj(files, notes)
         : extension == "stl" ? mend_stl(content, notes)
                              : "";
}

/// Returns an error text of libassimp in words for users. Throws std::bad_alloc again, which
/// libassimp catches.
std::string told(std::string text) {
  if (text.find("bad_alloc") != std::string::npos) {
    throw std::bad_alloc();
  }
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kTexts = {
      {{"mNumMeshes is 0", kNoTriangles},
       {"contains no faces", kNoTriangles},
       {"mIndices", "a face names a vertex that it does not have"},
       {"mMaterialIndex", "an object names a material that it does not have"},
       {"scene-graph is nullptr", "it has no 3D model that can be read"}}};
  for (const auto& [theirs, ours] : kTexts) {
    if (text.find(theirs) != std::string::npos) {
      return std::string(ours);
    }
  }
  constexpr std::size_t kMost = 200;  // Some have the rest of the file.
  text.resize(std::min({text.size(), kMost, text.find('\n')}));
  return text;
}

}  // namespace

ReadModel read_model(const std::string& extension, std::vector<ModelFile> files) {
  ReadModel out;
  const auto* convention =
      std::find_if(kConventions.begin(), kConventions.end(),
                   [&](const Convention& row) { return row.extension == extension; });
  if (convention == kConventions.end()) {
    out.fault = "its format is not known";
    return out;
  }
  const std::string left_out = mend_materials(files);
  const auto unit =
      extension == "3mf" ? check_3mf(files.front().content, out.notes) : std::string();
  out.fault = unit ? mend(extension, files, out.notes) : unit.error().message;
  if (!out.fault.empty()) {
    return out;
  }
  auto* const system = new Files(files);
  Assimp::Importer importer;
  importer.SetIOHandler(system);  // which the importer deletes
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // Normals of an STL are those of its triangles, and many files have none.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              extension == "stl" ? int{aiComponent_NORMALS} : 0);
  const std::string name = files.front().name;
  const aiScene* scene =
      importer.ReadFile(name, aiProcess_RemoveComponent | aiProcess_Triangulate |
                                  aiProcess_SortByPType | aiProcess_ValidateDataStructure);
  // libassimp joins vertices of different colours.
  const bool is_joined =
      scene != nullptr && std::none_of(scene->mMeshes, scene->mMeshes + scene->mNumMeshes,
                                       [](const aiMesh* m) { return m->HasVertexColors(0); });
  if (is_joined) {
    scene = importer.ApplyPostProcessing(aiProcess_JoinIdenticalVertices);
  }
  if (scene == nullptr || scene->mRootNode == nullptr) {
    out.fault = told(importer.GetErrorString());
    return out;
  }
  double metres = convention->metres;
  if (extension == "3mf") {
    const auto known = metres_of(*unit);
    metres = known.value_or(metres);
    out.notes.push_back("3MF: " + (known ? *unit : "unknown unit, millimeter") + ", z up.");
  } else {
    out.notes.emplace_back(convention->note);
  }
  Writer writer(*scene, *convention, metres, is_joined, *system, out.notes);
  out.fault = writer.write();
  // It also tries names that the file does not have.
  const std::string_view text(reinterpret_cast<const char*>(files.front().content.data()),
                              files.front().content.size());
  for (const std::string& missing : system->missing()) {
    if (text.find(missing) != std::string_view::npos) {
      out.notes.push_back(missing + " is missing; its materials are grey.");
    }
  }
  if (!left_out.empty()) {
    out.notes.push_back(left_out);
  }
  if (out.fault.empty()) {
    out.glb = writer.finish(out.notes);
  }
  return out;
}

}  // namespace core
