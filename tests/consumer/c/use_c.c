#include <hpsdf.h>
#include <stdio.h>

int main(void) {
  const double point[3] = {1.05, 0, 0};  // 0.05 outside the torus
  double value = 0, gradient[3] = {0, 0, 0};
  hpsdf_mesh* mesh = NULL;
  hpsdf_options* options = NULL;
  hpsdf_field* field = NULL;
  const int ok = hpsdf_mesh_load("builtin:torus", NULL, &mesh) == HPSDF_OK &&  // or a file, or hpsdf_mesh_new
                 hpsdf_options_new(&options) == HPSDF_OK &&
                 hpsdf_options_set(options, "target-error", "1e-6") == HPSDF_OK &&
                 hpsdf_build_mesh(mesh, NULL, options, NULL, &field) == HPSDF_OK &&
                 hpsdf_field_gradients(field, point, 1, &value, gradient) == HPSDF_OK;
  if (ok)
    printf("distance %.3f, gradient %.2f %.2f %.2f\n", value, gradient[0], gradient[1], gradient[2]);
  else
    fprintf(stderr, "%s\n", hpsdf_last_error());
  hpsdf_field_free(field);
  hpsdf_options_free(options);
  hpsdf_mesh_free(mesh);
  return ok && value > 0.04 && value < 0.06 ? 0 : 1;
}
