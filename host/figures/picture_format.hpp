#pragma once

namespace palpate {

enum class PictureFormat { png, svg };

}  // namespace palpate
