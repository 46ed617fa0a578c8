"""C17: what an impact takes does not depend on finite contact forces, whatever their stiffness and damping."""

from verification.proofs.algebra import scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.vocabulary import INVERSE_MASS, MASS_LEMMAS, MASS_RULES, MI, SYMMETRIC_MASS, M

CASE = instance({"M": [[1]], "M⁻¹": [[1]], "v⁺": [-1], "F": [3]}, h=1)


def statement() -> Statement:
    after, later, force, h = vector("v⁺", "d"), vector("vₕ", "d"), vector("F", "d"), scalar("h")
    name = equation(
        "finite forces F (springs, dampers, the hand) act for a time h", later, after + h * MI * force
    )
    change = identity(
        "what F adds to twice the energy",
        later.T * M * later - after.T * M * after,
        2 * h * after.T * force + h * h * force.T * MI * force,
        (name, name.T, *MASS_RULES),
        "every term carries a factor h: nothing is left for h → 0",
    )
    return Statement(
        name="loss_without_stiffness",
        title="Stiffness and damping take no part in the impact",
        source="paper II, V (8); C17",
        statement=(
            r"The impact (21) holds neither stiffness nor damping. Whatever finite force $F$ the springs "
            r"and dampers exert during the impact's duration $h$, it changes twice the kinetic energy by $2 "
            r"h \, {v^+}^\top F + h^2 F^\top M^{-1} F$, which vanishes with $h$."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS),
        definitions=(name,),
        steps=(*MASS_LEMMAS, change),
        concludes=(change.claim.name,),
        witness=CASE,
        needed=(
            Without(
                SYMMETRIC_MASS.name,
                instance(
                    {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "v⁺": [1, 0], "F": [1, 0]}, h=1
                ).with_values(F=[0, 1]),
            ),
            Without(INVERSE_MASS.name, CASE.with_values(M=[[2]])),
        ),
        twins=(
            Twin(
                "the same of a penalty contact, which needs a finite time",
                equation("F changes nothing", later.T * M * later, after.T * M * after),
                CASE,
                "a spring and damper that push with 3 N for 1 s: the loss depends on them, unlike that of "
                "an impact",
            ),
        ),
    )
