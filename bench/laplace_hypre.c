/* SPDX-License-Identifier: MIT */
#include "laplace.h"

#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_krylov.h>
#include <HYPRE_parcsr_ls.h>
#include <mpi.h>

/* Rows as hypre wants them, one after the other: its own copy is made of them. */
static void fill(const loxo_csr *a, const double *b, HYPRE_IJMatrix matrix, HYPRE_IJVector right, HYPRE_IJVector x)
{
    HYPRE_BigInt columns[4096];
    double values[4096];
    const double zero = 0.0;
    for (int64_t i = 0; i < a->n_rows; ++i) {
        const HYPRE_BigInt row = (HYPRE_BigInt)i;
        HYPRE_Int n = 0;
        columns[n] = row;
        values[n++] = a->diagonal[i] > 0.0 ? a->diagonal[i] : 1.0;
        for (int64_t k = a->begin[i]; k < a->begin[i + 1] && n < 4096; ++k) {
            columns[n] = (HYPRE_BigInt)a->column[k];
            values[n++] = a->value[k];
        }
        HYPRE_IJMatrixSetValues(matrix, 1, &n, &row, columns, values);
        HYPRE_IJVectorSetValues(right, 1, &row, &b[i]);
        HYPRE_IJVectorSetValues(x, 1, &row, &zero);
    }
}

/* Settings that its manual names for two dimensions and one thread: HMIS coarsening, extended+i interpolation of at most
 * four entries, symmetric Gauss-Seidel. */
static void choose(HYPRE_Solver amg)
{
    HYPRE_BoomerAMGSetPrintLevel(amg, 0);
    HYPRE_BoomerAMGSetCoarsenType(amg, 10);
    HYPRE_BoomerAMGSetInterpType(amg, 6);
    HYPRE_BoomerAMGSetPMaxElmts(amg, 4);
    HYPRE_BoomerAMGSetStrongThreshold(amg, 0.25);
    HYPRE_BoomerAMGSetRelaxType(amg, 6);
    HYPRE_BoomerAMGSetNumSweeps(amg, 1);
    HYPRE_BoomerAMGSetTol(amg, 0.0);
    HYPRE_BoomerAMGSetMaxIter(amg, 1);
}

loxo_status laplace_by_hypre(loxo_context *ctx, const loxo_csr *a, const double *b, double *x, laplace_result *result)
{
    const HYPRE_BigInt last = (HYPRE_BigInt)(a->n_rows - 1);
    HYPRE_IJMatrix matrix;
    HYPRE_IJVector right, solution;
    HYPRE_ParCSRMatrix parcsr;
    HYPRE_ParVector par_b, par_x;
    HYPRE_Solver cg, amg;
    HYPRE_Int n_steps = 0;
    MPI_Init(NULL, NULL);
    HYPRE_Init();
    const size_t before = laplace_resident_bytes(); /* with its own copy of the matrix */
    HYPRE_IJMatrixCreate(MPI_COMM_SELF, 0, last, 0, last, &matrix);
    HYPRE_IJMatrixSetObjectType(matrix, HYPRE_PARCSR);
    HYPRE_IJMatrixInitialize(matrix);
    HYPRE_IJVectorCreate(MPI_COMM_SELF, 0, last, &right);
    HYPRE_IJVectorCreate(MPI_COMM_SELF, 0, last, &solution);
    HYPRE_IJVectorSetObjectType(right, HYPRE_PARCSR);
    HYPRE_IJVectorSetObjectType(solution, HYPRE_PARCSR);
    HYPRE_IJVectorInitialize(right);
    HYPRE_IJVectorInitialize(solution);
    fill(a, b, matrix, right, solution);
    HYPRE_IJMatrixAssemble(matrix);
    HYPRE_IJVectorAssemble(right);
    HYPRE_IJVectorAssemble(solution);
    HYPRE_IJMatrixGetObject(matrix, (void **)&parcsr);
    HYPRE_IJVectorGetObject(right, (void **)&par_b);
    HYPRE_IJVectorGetObject(solution, (void **)&par_x);

    double clock = laplace_clock_s(ctx);
    HYPRE_ParCSRPCGCreate(MPI_COMM_SELF, &cg);
    HYPRE_PCGSetMaxIter(cg, 500);
    HYPRE_PCGSetTol(cg, LAPLACE_TOLERANCE);
    HYPRE_PCGSetTwoNorm(cg, 1);
    HYPRE_BoomerAMGCreate(&amg);
    choose(amg);
    HYPRE_PCGSetPrecond(cg, (HYPRE_PtrToSolverFcn)HYPRE_BoomerAMGSolve, (HYPRE_PtrToSolverFcn)HYPRE_BoomerAMGSetup,
                        amg);
    HYPRE_ParCSRPCGSetup(cg, parcsr, par_b, par_x);
    result->setup_s = laplace_clock_s(ctx) - clock;
    clock = laplace_clock_s(ctx);
    HYPRE_ParCSRPCGSolve(cg, parcsr, par_b, par_x);
    result->solve_s = laplace_clock_s(ctx) - clock;
    result->held_bytes = laplace_resident_bytes() - before;
    HYPRE_PCGGetNumIterations(cg, &n_steps);
    result->n_steps = n_steps;
    for (int64_t i = 0; i < a->n_rows; ++i) {
        const HYPRE_BigInt row = (HYPRE_BigInt)i;
        HYPRE_IJVectorGetValues(solution, 1, &row, &x[i]);
    }
    HYPRE_ParCSRPCGDestroy(cg);
    HYPRE_BoomerAMGDestroy(amg);
    HYPRE_IJMatrixDestroy(matrix);
    HYPRE_IJVectorDestroy(right);
    HYPRE_IJVectorDestroy(solution);
    HYPRE_Finalize();
    MPI_Finalize();
    return LOXO_OK;
}
