(* Theorems 1 and 2 and equation (33) of the paper, in any ring that is not commutative and has a transposition.

   Matrices of fitting sizes obey the laws of such a ring; no size occurs, so its identities are identities of matrices.
   The statements are those of verification/proofs/statements, written by hand. N is the inverse of the mass matrix M, J
   the contact Jacobian, v and w are the velocities before and after the impact, e the restitution, which commutes with
   all. The form of M vanishes only for x = 0 (`definite`), and the number `form` is its own transpose (`number`). *)

From Coq Require Import Ncring Ncring_tac.
Section Words.

(* a ring that is not commutative *)
Variable R : Type.
Variables (zero one : R) (add mul sub : R -> R -> R) (opp tr : R -> R).
Declare Scope words_scope.
Infix "+" := add : words_scope.
Infix "-" := sub : words_scope.
Infix "*" := mul : words_scope.
Notation "x ^T" := (tr x) (at level 8, left associativity, format "x ^T") : words_scope.
Open Scope words_scope.
Hypothesis zero_add : forall x, zero + x = x.
Hypothesis add_comm : forall x y, x + y = y + x.
Hypothesis add_assoc : forall x y z, x + (y + z) = x + y + z.
Hypothesis one_mul : forall x, one * x = x.
Hypothesis mul_one : forall x, x * one = x.
Hypothesis mul_assoc : forall x y z, x * (y * z) = x * y * z.
Hypothesis add_mul : forall x y z, (x + y) * z = x * z + y * z.
Hypothesis mul_add : forall x y z, z * (x + y) = z * x + z * y.
Hypothesis sub_opp : forall x y, x - y = x + opp y.
Hypothesis add_opp : forall x, x + opp x = zero.
Instance ring_operations : @Ring_ops R zero one add mul sub opp (@eq R) := {}.
Instance ring_of_words : @Ring R zero one add mul sub opp (@eq R) ring_operations.
Proof.
  split; [exact eq_equivalence | | | | | exact zero_add | exact add_comm | exact add_assoc | exact one_mul
    | exact mul_one | exact mul_assoc | exact add_mul | exact mul_add | exact sub_opp | exact add_opp];
    repeat (intros ? ? H; rewrite H; clear H); reflexivity.
Qed.

(* transposition *)
Hypothesis tr_tr : forall x, x^T^T = x.
Hypothesis tr_zero : zero^T = zero.
Hypothesis tr_one : one^T = one.
Hypothesis tr_add : forall x y, (x + y)^T = x^T + y^T.
Hypothesis tr_opp : forall x, (opp x)^T = opp x^T.
Hypothesis tr_mul : forall x y, (x * y)^T = y^T * x^T.

(* expansion: sums of words that are bracketed to the right; the ring axioms decide what remains *)
Lemma to_the_right : forall x y z, x * y * z = x * (y * z).
Proof. intros. symmetry. apply mul_assoc. Qed.
Lemma opp_mul : forall x y, opp x * y = opp (x * y).
Proof. intros. non_commutative_ring. Qed.
Lemma mul_opp : forall x y, x * opp y = opp (x * y).
Proof. intros. non_commutative_ring. Qed.
Hint Rewrite sub_opp add_mul mul_add to_the_right opp_mul mul_opp one_mul mul_one : expand.
Hint Rewrite tr_tr tr_zero tr_one tr_add tr_opp tr_mul : expand.
(* An equation of words, with anything to the right of it. *)
Lemma two {a b c} : a * b = c -> forall z, a * (b * z) = c * z.
Proof. intros H z. rewrite <- H. apply mul_assoc. Qed.
Ltac calculate := autorewrite with expand; (non_commutative_ring || fail "the identity leaves a remainder").

Section Impact.
Variables M N J G v w e : R.
Definition W := J * N * J^T.
Definition form := v^T * J^T * G * J * v.
Hypothesis symmetric : M^T = M.
Hypothesis inverse : M * N = one.
Hypothesis definite : forall x, x^T * M * x = zero -> x = zero.
Hypothesis one_inverse : W * G * W = W.
Hypothesis impact : w = v - (one + e) * N * J^T * G * J * v.
Hypothesis central : forall x, x * e = e * x.
Hypothesis scalar : e^T = e.
Hypothesis number : form^T = form.

Lemma inverse_symmetric : N^T = N.
Proof.
  transitivity (N^T * (M^T * N)); [rewrite symmetric, inverse; calculate |].
  rewrite mul_assoc, <- tr_mul, inverse. calculate.
Qed.
Lemma inverse_left : N * M = one.
Proof. rewrite <- inverse_symmetric, <- symmetric, <- tr_mul, inverse. apply tr_one. Qed.
Hint Rewrite symmetric inverse_symmetric inverse inverse_left (two inverse) (two inverse_left) : expand.

(* W G J = J, from W G W = W alone: the form of N (W G J - J)^T vanishes. *)
Lemma short : J * (N * (J^T * (G * (J * (N * J^T))))) = J * (N * J^T).
Proof. pose proof one_inverse as H. unfold W in H. autorewrite with expand in H. exact H. Qed.
Lemma turned : J * (N * (J^T * (G^T * (J * (N * J^T))))) = J * (N * J^T).
Proof. pose proof (f_equal tr short) as H. autorewrite with expand in H. exact H. Qed.
Lemma long {a b c d f g h k l m : R} : a * (b * (c * (d * (f * (g * h))))) = k * (l * m) ->
  forall z, a * (b * (c * (d * (f * (g * (h * z)))))) = k * (l * (m * z)).
Proof.
  intros H z. transitivity (a * (b * (c * (d * (f * (g * h))))) * z); [| rewrite H]; rewrite !to_the_right; reflexivity.
Qed.
Hint Rewrite short turned (long short) (long turned) : expand.

Lemma row_space : W * G * J = J.
Proof.
  assert (Z : N * (W * G * J - J)^T = zero) by (apply definite; unfold W; calculate).
  assert (Y : W * G * J - J = zero).
  { rewrite <- (tr_tr (W * G * J - J)), <- (one_mul (W * G * J - J)^T), <- inverse, to_the_right, Z. calculate. }
  transitivity ((W * G * J - J) + J); [calculate | rewrite Y; calculate].
Qed.
Lemma row_space_right : J * (N * (J^T * (G * (J * v)))) = J * v.
Proof. transitivity (W * G * J * v); [unfold W; rewrite !to_the_right | rewrite row_space]; reflexivity. Qed.

(* e stands in front of every word *)
Lemma past : forall x y, x * (e * y) = e * (x * y).
Proof. intros x y. rewrite mul_assoc, central. apply to_the_right. Qed.
Lemma number_right : v^T * (J^T * (G^T * (J * v))) = v^T * (J^T * (G * (J * v))).
Proof. pose proof number as H. unfold form in H. autorewrite with expand in H. exact H. Qed.
Hint Rewrite scalar row_space_right number_right : expand.
Hint Rewrite (central v) (central v^T) (central G) (central G^T) (central J) (central J^T) : expand.
Hint Rewrite (past v) (past v^T) (past G) (past G^T) (past J) (past J^T) : expand.
Hint Rewrite (central N) (central M) (past N) (past M) : expand.

Theorem theorem_2 : J * w = opp (e * J * v)
  /\ v^T * M * v - w^T * M * w = (one - e * e) * form
  /\ form = (N * J^T * G * J * v)^T * M * (N * J^T * G * J * v).
Proof. rewrite impact. unfold form. repeat split; calculate. Qed.

End Impact.

(* One row: omega is an inverse of J N J^T, so it is a {1}-inverse. *)
Theorem theorem_1 M N J omega v w e :
  M^T = M -> M * N = one -> (forall x, x^T * M * x = zero -> x = zero) -> J * N * J^T * omega = one ->
  w = v - (one + e) * N * J^T * omega * J * v -> (forall x, x * e = e * x) -> e^T = e ->
  (v^T * J^T * omega * J * v)^T = v^T * J^T * omega * J * v ->
  J * w = opp (e * J * v)
  /\ v^T * M * v - w^T * M * w = (one - e * e) * (v^T * J^T * omega * J * v)
  /\ v^T * J^T * omega * J * v = (N * J^T * omega * J * v)^T * M * (N * J^T * omega * J * v).
Proof. intros; apply theorem_2; auto. unfold W. rewrite H2. apply one_mul. Qed.

(* (33): redundant rows J = S K of independent rows K, chosen by C, with L the inverse of K N K^T. *)
Theorem independent_subset N J G K L S C :
  J = S * K -> C * S = one -> L * (K * N * K^T) = one -> K * N * K^T * L = one ->
  J * N * J^T * G * (J * N * J^T) = J * N * J^T -> J^T * G * J = K^T * L * K.
Proof.
  intros rows choice left right one_inverse.
  set (W := K * N * K^T) in *.
  assert (squeezed : W * (S^T * G * S) * W = W).
  { transitivity (C * (J * N * J^T * G * (J * N * J^T)) * C^T); [| rewrite one_inverse]; rewrite rows; unfold W;
      pose proof (f_equal tr choice) as turned; rewrite tr_mul, tr_one in turned;
      autorewrite with expand; rewrite ?choice, ?turned, ?(two choice), ?(two turned); autorewrite with expand;
      reflexivity. }
  assert (core : S^T * G * S = L).
  { transitivity (L * (W * (S^T * G * S) * W) * L).
    - rewrite <- (one_mul (S^T * G * S)), <- left at 1. rewrite <- (mul_one (L * W * _)), <- right at 1.
      rewrite !to_the_right. reflexivity.
    - rewrite squeezed, left. apply one_mul. }
  rewrite rows, tr_mul, <- core. rewrite !to_the_right. reflexivity.
Qed.

End Words.
Print Assumptions theorem_1.
Print Assumptions theorem_2.
Print Assumptions independent_subset.
