/* A finite-element code in small: a clamped beam of four elements with a rigid body of 100 kg at its tip, assembled into
 * triplets, with the body fixed to the beam by six constraints. It is the scene `beam-body` of the program, and prints the
 * modes that `kschur solve` finds for it.
 *
 * Unknowns of a node: translations (m), then rotations (rad), along x, y, z; node 0 is the body, nodes 1 to 4 are the
 * beam's; its clamped end has none. */
#include <kschur.h>
#include <math.h>
#include <stdio.h>

enum { elements = 4, unknowns = 6 * (elements + 1), constraints = 6, modes = 6, room = 1000 };

/* The beam of the paper's Table 2: E (Pa), G (Pa), density (kg/m^3), widths along y and z (m). */
static const double youngs_modulus = 100e6, poisson_ratio = 0.31, density = 1000, width_y = 0.05, width_z = 0.3;
/* Rayleigh damping, alpha (1/s) and beta (s). */
static const double alpha = 1e-3, beta = 1e-5;
static const double beam_length = 6, tip_mass = 100, edge[3] = {0.5, 1, 1};

typedef struct {
   int64_t entries;
   int32_t row[room], column[room];
   double value[room];
} triplets;

static void add(triplets *matrix, int row, int column, double value)
{
   matrix->row[matrix->entries] = row;
   matrix->column[matrix->entries] = column;
   matrix->value[matrix->entries++] = value;
}

/* Two equal springs' ends: k [1 -1; -1 1]. */
static void add_spring(double k[12][12], int i, double value)
{
   k[i][i] = k[i + 6][i + 6] = value;
   k[i][i + 6] = k[i + 6][i] = -value;
}

/* Bending with deflections at u and u + 6 and slopes at r and r + 6; a rotation about y is minus the slope along z, which a
 * negative length says. */
static void add_bending(double k[12][12], int u, int r, double stiffness, double l)
{
   const int place[4] = {u, r, u + 6, r + 6};
   const double shape[4][4] = {{12, 6 * l, -12, 6 * l},
                               {6 * l, 4 * l * l, -6 * l, 2 * l * l},
                               {-12, -6 * l, 12, -6 * l},
                               {6 * l, 2 * l * l, -6 * l, 4 * l * l}};

   for (int i = 0; i < 4; i++)
      for (int j = 0; j < 4; j++) k[place[i]][place[j]] = stiffness * shape[i][j];
}

/* The Euler-Bernoulli element and its lumped mass. */
static void element_matrices(double l, double k[12][12], double m[12])
{
   const double area = width_y * width_z, shear_modulus = youngs_modulus / (2 * (1 + poisson_ratio));
   const double moment_y = width_y * pow(width_z, 3) / 12, moment_z = width_z * pow(width_y, 3) / 12;
   const double ratio = width_y / width_z;
   const double torsion = width_z * pow(width_y, 3) * (1.0 / 3 - 0.21 * ratio * (1 - pow(ratio, 4) / 12));
   const double per_length = density * area, polar = density * (moment_y + moment_z);
   const double nodal[6] = {per_length, per_length, per_length, polar, per_length / 500, per_length / 500};

   for (int i = 0; i < 12; i++) {
      m[i] = l / 2 * nodal[i % 6];
      for (int j = 0; j < 12; j++) k[i][j] = 0;
   }
   add_spring(k, 0, youngs_modulus * area / l);
   add_spring(k, 3, shear_modulus * torsion / l);
   add_bending(k, 1, 5, youngs_modulus * moment_z / pow(l, 3), l);
   add_bending(k, 2, 4, youngs_modulus * moment_y / pow(l, 3), -l);
}

static void add_beam(triplets *mass, triplets *damping, triplets *stiffness)
{
   double k[12][12], m[12];

   element_matrices(beam_length / elements, k, m);
   for (int e = 0; e < elements; e++)
      for (int i = 0; i < 12; i++) {
         /* The clamped end of the first element has no unknowns. */
         int row = 6 * e + i;
         if (row < 6) continue;
         add(mass, row, row, m[i]);
         add(damping, row, row, alpha * m[i]);
         for (int j = 0; j < 12; j++) {
            int column = 6 * e + j;
            if (column < 6 || k[i][j] == 0) continue;
            add(stiffness, row, column, k[i][j]);
            add(damping, row, column, beta * k[i][j]);
         }
      }
}

/* A box whose centre is half an edge beyond the tip: u_tip = u_body + theta_body x r, theta_tip = theta_body. */
static void add_body(triplets *mass, triplets *constraint)
{
   const int tip = 6 * elements;
   const double squares = edge[0] * edge[0] + edge[1] * edge[1] + edge[2] * edge[2], arm = -edge[0] / 2;

   for (int i = 0; i < 3; i++) {
      add(mass, i, i, tip_mass);
      add(mass, 3 + i, 3 + i, tip_mass / 12 * (squares - edge[i] * edge[i]));
   }
   for (int i = 0; i < 6; i++) {
      add(constraint, i, i, -1);
      add(constraint, i, tip + i, 1);
   }
   /* -theta x r with r along x. */
   add(constraint, 1, 5, -arm);
   add(constraint, 2, 4, arm);
}

int main(void)
{
   static triplets mass, damping, stiffness, constraint;
   kschur_problem *problem = NULL;
   kschur_options *options = NULL;
   kschur_result *result = NULL;
   double eigenvalue[2 * modes], frequency[modes], ratio[modes];
   char message[500] = "";
   int status;

   add_beam(&mass, &damping, &stiffness);
   add_body(&mass, &constraint);
   kschur_problem_create(&problem);
   kschur_problem_set_triplets(problem, KSCHUR_MASS, unknowns, unknowns, mass.entries, 0, mass.row, mass.column, mass.value);
   kschur_problem_set_triplets(problem, KSCHUR_DAMPING, unknowns, unknowns, damping.entries, 0, damping.row,
                               damping.column, damping.value);
   kschur_problem_set_triplets(problem, KSCHUR_STIFFNESS, unknowns, unknowns, stiffness.entries, 0, stiffness.row,
                               stiffness.column, stiffness.value);
   kschur_problem_set_triplets(problem, KSCHUR_CONSTRAINTS, constraints, unknowns, constraint.entries, 0, constraint.row,
                               constraint.column, constraint.value);
   kschur_options_create(&options);
   kschur_options_set_modes(options, modes);
   kschur_result_create(&result);

   status = kschur_solve(problem, options, result);
   if (status == KSCHUR_OK) status = kschur_result_get_eigenvalues(result, eigenvalue, 2 * modes);
   if (status == KSCHUR_OK) status = kschur_result_get_frequencies_hz(result, frequency, modes);
   if (status == KSCHUR_OK) status = kschur_result_get_damping_ratios(result, ratio, modes);
   if (status == KSCHUR_OK) {
      printf("      Re (1/s)       Im (1/s)  frequency (Hz)   damping ratio\n");
      for (int j = 0; j < modes; j++)
         printf("%14.7e %14.7e  %14.7e  %14.7e\n", eigenvalue[2 * j], eigenvalue[2 * j + 1], frequency[j], ratio[j]);
   } else {
      kschur_result_get_message(result, message, sizeof message);
      printf("%s\n", message);
   }
   kschur_result_destroy(&result);
   kschur_options_destroy(&options);
   kschur_problem_destroy(&problem);
   return status;
}
