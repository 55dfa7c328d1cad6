#include "tests/unit/visibility/test_meshes.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#if defined(__SANITIZE_THREAD__)
// Embree and oneTBB come without instrumentation: the thread sanitizer does not see how they hand work over.
extern "C" const char* __tsan_default_suppressions() {
    return "called_from_lib:libembree3.so\ncalled_from_lib:libtbb.so\nrace:libembree3\nrace:libtbb\n";
}
#endif

namespace umbriel::visibility::test {
namespace {

void quad(Mesh& m, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    m.indices.insert(m.indices.end(), {a, b, c, a, c, d});
}

}  // namespace

Mesh cloth(std::uint32_t around, std::uint32_t down) {
    Mesh m;
    constexpr double kTurn = 2.0 * std::numbers::pi;
    constexpr int kFolds = 14;
    for (std::uint32_t j = 0; j < down; ++j) {
        for (std::uint32_t i = 0; i < around; ++i) {
            const double v = static_cast<double>(j) / (down - 1), u = static_cast<double>(i) / around;
            const double phase =
                3.0 * (0.35 * std::sin(3 * kTurn * u + 2 * v) + 0.25 * std::sin(5 * kTurn * u - 4 * v));
            const double t = kTurn * kFolds * u + phase;
            const double x = t - 0.85 * v * std::sin(2 * t);
            const double y = (0.02 + 0.16 * v) * std::sin(t) * (1 + 0.25 * std::sin(4 * kTurn * u + 3 * v));
            const double angle = (x - phase) / kFolds;
            const double radius =
                0.35 + 0.45 * v + y + 0.02 * std::sin(9 * v + 2 * kTurn * u) + 0.006 * std::sin(37 * v + 9 * kTurn * u);
            m.positions.emplace_back(radius * std::cos(angle), 1.6 * (1 - v), radius * std::sin(angle));
        }
    }
    for (std::uint32_t j = 0; j + 1 < down; ++j) {
        for (std::uint32_t i = 0; i < around; ++i) {
            const std::uint32_t a = j * around + i, b = j * around + (i + 1) % around;
            m.indices.insert(m.indices.end(), {a, b, a + around, b, b + around, a + around});
        }
    }
    return m;
}

Mesh plate(std::uint32_t n) {
    Mesh m;
    for (std::uint32_t j = 0; j <= n; ++j) {
        for (std::uint32_t i = 0; i <= n; ++i) m.positions.emplace_back(2.0f * i / n - 1.0f, 2.0f * j / n - 1.0f, 0.0f);
    }
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i;
            quad(m, a, a + 1, a + n + 2, a + n + 1);
        }
    }
    return m;
}

Mesh sphere(int splits) {
    Mesh m;
    m.positions = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    m.indices = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5};
    for (int split = 0; split < splits; ++split) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [entry, isNew] = middles.try_emplace(std::minmax(a, b), m.positions.size());
            if (isNew) m.positions.push_back(glm::normalize(m.positions[a] + m.positions[b]));
            return entry->second;
        };
        std::vector<std::uint32_t> next;
        for (std::size_t t = 0; t < m.indices.size(); t += 3) {
            const std::uint32_t a = m.indices[t], b = m.indices[t + 1], c = m.indices[t + 2];
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            next.insert(next.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
        }
        m.indices = std::move(next);
    }
    return m;
}

Mesh box(std::uint32_t n, bool inwards) {
    Mesh m;
    for (int axis = 0; axis < 3; ++axis) {
        for (const float side : {-1.0f, 1.0f}) {
            const auto first = static_cast<std::uint32_t>(m.positions.size());
            for (std::uint32_t j = 0; j <= n; ++j) {
                for (std::uint32_t i = 0; i <= n; ++i) {
                    glm::vec3 p;
                    p[axis] = side;
                    p[(axis + 1) % 3] = 2.0f * i / n - 1.0f;
                    p[(axis + 2) % 3] = 2.0f * j / n - 1.0f;
                    m.positions.push_back(p);
                }
            }
            for (std::uint32_t j = 0; j < n; ++j) {
                for (std::uint32_t i = 0; i < n; ++i) {
                    const std::uint32_t a = first + j * (n + 1) + i;
                    if ((side > 0) != inwards) {
                        quad(m, a, a + 1, a + n + 2, a + n + 1);
                    } else {
                        quad(m, a, a + n + 1, a + n + 2, a + 1);
                    }
                }
            }
        }
    }
    return m;
}

Mesh accordion(std::uint32_t folds, std::uint32_t n, float gap) {
    // Profile in x, z: up, over by gap, down, over by gap, ...; drawn along y.
    Mesh m;
    std::vector<glm::vec2> profile;
    for (std::uint32_t f = 0; f < folds; ++f) {
        const float x = 2 * gap * f;
        profile.insert(profile.end(), {{x, 0}, {x, 0.5f}, {x, 1}, {x + gap, 1}, {x + gap, 0.5f}, {x + gap, 0}});
    }
    const auto width = static_cast<std::uint32_t>(profile.size());
    for (std::uint32_t j = 0; j <= n; ++j) {
        for (const glm::vec2& p : profile) m.positions.emplace_back(p.x, 2.0f * j / n, p.y);
    }
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i + 1 < width; ++i)
            quad(m, j * width + i, j * width + i + 1, (j + 1) * width + i + 1, (j + 1) * width + i);
    }
    return m;
}

Mesh moved(Mesh mesh, const glm::dvec3& by) {
    for (glm::vec3& p : mesh.positions) p = glm::vec3(glm::dvec3(p) + by);
    return mesh;
}

std::optional<Mesh> load(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) return std::nullopt;
    Mesh m;
    std::string line;
    const auto fan = [&](const std::vector<std::uint32_t>& polygon) {
        for (std::size_t i = 2; i < polygon.size(); ++i) {
            m.indices.insert(m.indices.end(), {polygon[0], polygon[i - 1], polygon[i]});
        }
    };
    if (path.ends_with(".obj")) {
        while (std::getline(in, line)) {
            std::istringstream words(line);
            std::string kind;
            words >> kind;
            if (kind == "v") {
                glm::vec3 p;
                words >> p.x >> p.y >> p.z;
                m.positions.push_back(p);
            } else if (kind == "f") {
                std::vector<std::uint32_t> polygon;
                for (std::string corner; words >> corner;)
                    polygon.push_back(static_cast<std::uint32_t>(std::stoul(corner) - 1));
                fan(polygon);
            }
        }
        return m;
    }
    std::size_t vertices = 0, faces = 0, floats = 0;
    bool ascii = false, inVertex = false;
    while (std::getline(in, line) && line.rfind("end_header", 0) != 0) {
        if (line.rfind("format ascii", 0) == 0) ascii = true;
        if (line.rfind("element vertex", 0) == 0) vertices = std::stoul(line.substr(15)), inVertex = true;
        if (line.rfind("element face", 0) == 0) faces = std::stoul(line.substr(13)), inVertex = false;
        if (inVertex && line.rfind("property float", 0) == 0) ++floats;
    }
    for (std::size_t i = 0; i < vertices; ++i) {
        std::vector<float> values(floats);
        if (ascii) {
            for (float& value : values) in >> value;
        } else {
            in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(4 * floats));
        }
        m.positions.emplace_back(values[0], values[1], values[2]);
    }
    for (std::size_t i = 0; i < faces; ++i) {
        unsigned count = 0;
        if (ascii) {
            in >> count;
        } else {
            count = static_cast<unsigned char>(in.get());
        }
        std::vector<std::uint32_t> polygon(count);
        if (ascii) {
            for (std::uint32_t& corner : polygon) in >> corner;
        } else {
            in.read(reinterpret_cast<char*>(polygon.data()), static_cast<std::streamsize>(4 * count));
        }
        fan(polygon);
    }
    return m;
}

std::optional<Mesh> loadShared(const std::string& name) {
    const char* shared = std::getenv("UMBRIEL_SHARED");
    if (!shared) return std::nullopt;
    return load(std::string(shared) + "/data/" + name);
}

}  // namespace umbriel::visibility::test
