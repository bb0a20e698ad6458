#include "common/scene/scene.hpp"
