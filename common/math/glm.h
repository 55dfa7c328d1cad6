#pragma once

// The one place that includes GLM, so that its configuration (CMake definitions) and its size are the same everywhere.
#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
