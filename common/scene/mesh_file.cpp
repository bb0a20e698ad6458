#include "common/scene/mesh_file.hpp"

#include <assimp/GltfMaterial.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <string_view>

#include "common/scene/gltf_extensions.hpp"

namespace pvsfarm {
namespace {

// file_from_node = linear * p + offset, in double.
struct Transform {
  Vec3 column[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vec3 offset{0.0};

  Vec3 operator()(const Vec3& p) const {
    return column[0] * p.x + column[1] * p.y + column[2] * p.z + offset;
  }
  bool mirrors() const { return dot(cross(column[0], column[1]), column[2]) < 0; }
};

Transform after(const Transform& outer, const aiMatrix4x4& m) {
  if (m.IsIdentity()) return outer;
  Transform t;
  const Vec3 columns[3] = {{m.a1, m.b1, m.c1}, {m.a2, m.b2, m.c2}, {m.a3, m.b3, m.c3}};
  for (int k = 0; k < 3; ++k)
    t.column[k] = outer.column[0] * columns[k].x + outer.column[1] * columns[k].y +
                  outer.column[2] * columns[k].z;
  t.offset = outer(Vec3(m.a4, m.b4, m.c4));
  return t;
}

struct Surface {
  bool opaque = true;
  bool two_sided = true;
};

// glTF says both outright. The other formats have no culling flag, and are opaque unless they name
// a transparency.
Surface surface_of(const aiMaterial& material, bool is_gltf) {
  Surface surface;
  if (is_gltf) {
    int two_sided = 0;
    aiString alpha_mode;
    float transmission = 0;
    material.Get(AI_MATKEY_TWOSIDED, two_sided);
    if (material.Get(AI_MATKEY_GLTF_ALPHAMODE, alpha_mode) == AI_SUCCESS)
      surface.opaque = std::string_view(alpha_mode.C_Str()) == "OPAQUE";
    if (material.Get(AI_MATKEY_TRANSMISSION_FACTOR, transmission) == AI_SUCCESS)
      surface.opaque = surface.opaque && transmission == 0;
    surface.two_sided = two_sided != 0;
  } else {
    float opacity = 1;
    material.Get(AI_MATKEY_OPACITY, opacity);
    surface.opaque = opacity >= 1 && material.GetTextureCount(aiTextureType_OPACITY) == 0;
  }
  return surface;
}

bool has_tag(const aiNode& node, const char* key, bool& value) {
  return node.mMetaData != nullptr && node.mMetaData->Get(key, value);
}

// Walks the nodes in file order and turns each that holds triangles into an object.
class NodeReader {
 public:
  NodeReader(const aiScene& scene, bool is_gltf, UpAxis up) : scene_(scene), is_gltf_(is_gltf) {
    file_.up = up;
    for (unsigned i = 0; i < scene.mNumAnimations; ++i)
      for (unsigned c = 0; c < scene.mAnimations[i]->mNumChannels; ++c)
        animated_.insert(scene.mAnimations[i]->mChannels[c]->mNodeName.C_Str());
  }

  // Depth first with a stack of its own: a file may nest deeper than ours.
  Result<MeshFile> read() {
    struct Visit {
      const aiNode* node;
      Transform parent;
      bool parent_moves;
    };
    std::vector<Visit> stack{{scene_.mRootNode, {}, false}};
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const aiNode& node = *visit.node;
      const Transform file_from_node = after(visit.parent, node.mTransformation);
      const bool moves = visit.parent_moves || animated_.count(node.mName.C_Str()) > 0;
      if (const Status s = add_node(node, file_from_node, moves); !s.ok()) return s.error();
      for (unsigned i = node.mNumChildren; i-- > 0;)
        stack.push_back({node.mChildren[i], file_from_node, moves});
    }
    return std::move(file_);
  }

 private:
  Status add_node(const aiNode& node, const Transform& file_from_node, bool moves) {
    SourceObject object;
    object.name = node.mName.C_Str();
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
      if (!add_mesh(mesh, file_from_node, object))
        return invalid_input("object " + std::to_string(file_.objects.size()) + " '" + object.name +
                             "' has a face without its vertices, or a vertex that "
                             "is not a number; repair the mesh");
      const Surface surface = surface_of(*scene_.mMaterials[mesh.mMaterialIndex], is_gltf_);
      object.occluder = object.occluder && surface.opaque;
      object.two_sided = object.two_sided && surface.two_sided;
      moves = moves || mesh.HasBones() || mesh.mNumAnimMeshes > 0;
    }
    if (object.triangles.empty()) return {};
    bool tag = false;
    if (has_tag(node, "occluder", tag)) object.occluder = object.occluder && tag;
    if (has_tag(node, "occludee", tag)) object.occludee = tag;
    if (has_tag(node, "dynamic", tag)) object.dynamic = tag;
    if (moves && !object.dynamic) {
      object.dynamic = true;
      ++file_.animated_objects;
    }
    file_.objects.push_back(std::move(object));
    return {};
  }

  bool add_mesh(const aiMesh& mesh, const Transform& file_from_node, SourceObject& object) const {
    const auto base = static_cast<std::uint32_t>(object.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const Vec3 point = file_from_node(Vec3(p.x, p.y, p.z));
      if (!std::isfinite(point.x + point.y + point.z)) return false;
      object.vertices.push_back(internal_from_file(file_.up, point));
    }
    const bool flip = file_from_node.mirrors();  // as glTF demands of a renderer
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      for (int k = 0; k < 3; ++k)
        if (face.mIndices[k] >= mesh.mNumVertices) return false;
      object.triangles.push_back({base + face.mIndices[0], base + face.mIndices[flip ? 2 : 1],
                                  base + face.mIndices[flip ? 1 : 2]});
    }
    return true;
  }

  const aiScene& scene_;
  const bool is_gltf_;
  std::set<std::string> animated_;
  MeshFile file_;
};

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Status check_readable(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return invalid_input(path + ": no such file; check the path");
  if (!std::filesystem::is_regular_file(path, error) || !std::ifstream(path))
    return invalid_input(path + ": cannot be read; check that it is a file and its permissions");
  return {};
}

// assimp never returns from a PLY header that does not end.
Status check_ply_header(const std::string& path) {
  constexpr std::size_t kMaxHeaderBytes = 65536;
  std::ifstream file(path, std::ios::binary);
  std::string start(kMaxHeaderBytes, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  const std::size_t end = std::min(start.find("\nend_header\n"), start.find("\nend_header\r\n"));
  if (start.compare(0, 3, "ply") != 0 || end == std::string::npos)
    return invalid_input(path + ": the PLY header is cut short or broken; export the file again");
  return {};
}

// Null: `why` says what is wrong.
const aiScene* load(Assimp::Importer& importer, const std::string& path, std::string& why) {
  const aiScene* scene = importer.ReadFile(path, 0);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    why = one_line(importer.GetErrorString());
    return nullptr;
  }
  // Before triangulating, which asserts that this is so.
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
      const std::span indices(face.mIndices, face.mNumIndices);
      if (indices.empty() ||
          *std::max_element(indices.begin(), indices.end()) >= mesh.mNumVertices) {
        why = "mesh " + std::to_string(m) + " has a face without its vertices";
        return nullptr;
      }
    }
  }
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
  if (scene == nullptr) why = one_line(importer.GetErrorString());
  return scene;
}

}  // namespace

Result<MeshFile> read_mesh_file(const std::string& path, std::optional<UpAxis> up) {
  const std::string extension = extension_of(path);
  const bool is_gltf = extension == ".gltf" || extension == ".glb";
  if (!is_gltf && extension != ".obj" && extension != ".ply")
    return Error{ErrorKind::kUnsupported,
                 path + ": unknown file type; export the scene as .glb, .gltf, .obj or .ply"};
  if (const Status s = check_readable(path); !s.ok()) return s.error();
  if (is_gltf)
    if (const Status s = check_gltf_extensions(path); !s.ok()) return s.error();
  if (extension == ".ply")
    if (const Status s = check_ply_header(path); !s.ok()) return s.error();

  Assimp::Importer importer;
  std::string why;
  const aiScene* scene = load(importer, path, why);
  if (scene == nullptr)
    return invalid_input(path + ": cannot be read as a mesh (" + why +
                         "); repair or export it again");
  Result<MeshFile> file =
      NodeReader(*scene, is_gltf, up.value_or(is_gltf ? UpAxis::kY : UpAxis::kZ)).read();
  if (!file) return Error{file.error().kind, path + ": " + file.error().text};
  if (file->objects.empty())
    return invalid_input(path + ": holds no triangles; export at least one mesh");
  return file;
}

}  // namespace pvsfarm
