(* An exact judge of impacts: whether w has no more kinetic energy than v, for M as given, over the real numbers.

   A double is a dyadic number: an integer m times a power 2^e. Sums and products of dyadic numbers are exact, so
   comparing w'Mw with v'Mv needs no rounding. [check_sound]: if [check] says yes, the inequality holds over the reals;
   [check_complete]: if it says no of an impact whose lists have fitting lengths, the energy is larger. M need not be
   symmetric: its skew part cancels in both forms. *)

From Coq Require Import ZArith Reals List Bool Lia Lra Extraction ExtrOcamlBasic.
Import ListNotations.
Open Scope Z_scope.

(* A dyadic number, and the real number that it stands for. *)
Record dyadic := Dyadic { mantissa : Z; exponent : Z }.
Definition real (x : dyadic) : R := (IZR (mantissa x) * powerRZ 2 (exponent x))%R.

Definition zero := Dyadic 0 0.
Definition times (x y : dyadic) := Dyadic (mantissa x * mantissa y) (exponent x + exponent y).
(* The mantissa of x for a smaller exponent e. *)
Definition scaled (x : dyadic) (e : Z) := Z.shiftl (mantissa x) (exponent x - e).
Definition plus (x y : dyadic) :=
  if mantissa x =? 0 then y else if mantissa y =? 0 then x else
  let e := Z.min (exponent x) (exponent y) in Dyadic (scaled x e + scaled y e) e.
Definition opposite (x : dyadic) := Dyadic (- mantissa x) (exponent x).
Definition not_positive (x : dyadic) := mantissa x <=? 0.

Fixpoint dot (a b : list dyadic) : dyadic :=
  match a, b with x :: a', y :: b' => plus (times x y) (dot a' b') | _, _ => zero end.
(* x'Mx of the rows of M. *)
Definition form (rows : list (list dyadic)) (x : list dyadic) := dot x (map (fun row => dot row x) rows).

Definition is_long (d : nat) {A} (l : list A) := Nat.eqb (length l) d.
Definition fits (d : nat) (rows : list (list dyadic)) (v w : list dyadic) :=
  is_long d v && is_long d w && is_long d rows && forallb (is_long d) rows.
Definition check (d : nat) (rows : list (list dyadic)) (v w : list dyadic) : bool :=
  fits d rows v w && not_positive (plus (form rows w) (opposite (form rows v))).

(* What is claimed, in plain sums over indices. *)
Fixpoint sum (n : nat) (f : nat -> R) : R :=
  match n with O => 0%R | S m => (sum m f + f m)%R end.
Definition entry (l : list dyadic) (i : nat) : R := real (nth i l zero).
Definition quadratic (d : nat) (rows : list (list dyadic)) (x : list dyadic) : R :=
  sum d (fun i => sum d (fun j => entry x i * entry (nth i rows []) j * entry x j))%R.

Lemma real_zero : real zero = 0%R.
Proof. unfold real; simpl; ring. Qed.

Lemma real_times x y : real (times x y) = (real x * real y)%R.
Proof. unfold real, times; simpl. rewrite mult_IZR, powerRZ_add by lra. ring. Qed.

Lemma real_scaled x e : e <= exponent x -> (IZR (scaled x e) * powerRZ 2 e = real x)%R.
Proof.
  intro H. unfold scaled, real. rewrite Z.shiftl_mul_pow2 by lia.
  rewrite mult_IZR. replace (exponent x) with ((exponent x - e) + e) at 2 by lia.
  rewrite powerRZ_add by lra.
  rewrite <- (Z2Nat.id (exponent x - e)) by lia.
  rewrite <- pow_IZR, <- pow_powerRZ. ring.
Qed.

Lemma real_empty x : mantissa x = 0 -> real x = 0%R.
Proof. unfold real; intros ->; ring. Qed.

Lemma real_plus x y : real (plus x y) = (real x + real y)%R.
Proof.
  unfold plus.
  destruct (Z.eqb_spec (mantissa x) 0) as [H | _]; [rewrite (real_empty _ H); ring |].
  destruct (Z.eqb_spec (mantissa y) 0) as [H | _]; [rewrite (real_empty _ H); ring |].
  rewrite <- (real_scaled x (Z.min (exponent x) (exponent y))) by lia.
  rewrite <- (real_scaled y (Z.min (exponent x) (exponent y))) by lia.
  unfold real; simpl. rewrite plus_IZR. ring.
Qed.

Lemma real_opposite x : real (opposite x) = (- real x)%R.
Proof. unfold real, opposite; simpl. rewrite opp_IZR. ring. Qed.

Lemma not_positive_real x : not_positive x = true <-> (real x <= 0)%R.
Proof.
  assert (P : (0 < powerRZ 2 (exponent x))%R) by (apply powerRZ_lt; lra).
  unfold not_positive, real. rewrite Z.leb_le. split; intro H.
  - apply IZR_le in H. nra.
  - apply le_IZR. apply Rnot_lt_le. intro L. nra.
Qed.

Lemma sum_first n f : (sum (S n) f = f 0%nat + sum n (fun i => f (S i)))%R.
Proof. induction n as [| n IH]; simpl in *; [ring | rewrite IH; ring]. Qed.

Lemma sum_equal n f g : (forall i, (i < n)%nat -> f i = g i) -> sum n f = sum n g.
Proof.
  induction n as [| n IH]; intro H; simpl; [reflexivity |].
  rewrite H by lia. f_equal. apply IH. intros. apply H. lia.
Qed.

Lemma sum_times n c f : (sum n (fun i => c * f i) = c * sum n f)%R.
Proof. induction n as [| n IH]; simpl; [ring | rewrite IH; ring]. Qed.

Lemma real_dot a b d : length a = d -> length b = d ->
  real (dot a b) = sum d (fun i => entry a i * entry b i)%R.
Proof.
  revert b d. induction a as [| x a IH]; intros b d Ha Hb; destruct b as [| y b]; simpl in *; subst;
    try discriminate; try apply real_zero.
  rewrite sum_first, real_plus, real_times. f_equal.
  apply IH; congruence.
Qed.

Lemma real_form d rows x : length x = d -> length rows = d -> (forall row, In row rows -> length row = d) ->
  real (form rows x) = quadratic d rows x.
Proof.
  intros Hx Hr Hrows. unfold form, quadratic.
  rewrite (real_dot _ _ d) by (rewrite ?map_length; assumption).
  apply sum_equal. intros i Hi. unfold entry at 2.
  rewrite (nth_indep _ zero (dot [] x)) by (rewrite map_length; lia).
  rewrite map_nth with (f := fun row => dot row x).
  rewrite (real_dot _ _ d) by (try apply Hrows, nth_In; lia).
  rewrite <- sum_times. apply sum_equal. intros. ring.
Qed.

Lemma fits_lengths d rows v w : fits d rows v w = true ->
  length v = d /\ length w = d /\ length rows = d /\ (forall row, In row rows -> length row = d).
Proof.
  unfold fits, is_long. rewrite !andb_true_iff, !Nat.eqb_eq, forallb_forall.
  intros [[[Hv Hw] Hr] H]. repeat split; auto.
  intros row Hi. apply Nat.eqb_eq, H, Hi.
Qed.

Lemma compared d rows v w : fits d rows v w = true ->
  real (plus (form rows w) (opposite (form rows v))) = (quadratic d rows w - quadratic d rows v)%R.
Proof.
  intro H. apply fits_lengths in H. destruct H as (Hv & Hw & Hr & Hrows).
  rewrite real_plus, real_opposite, !(real_form d) by assumption. ring.
Qed.

Theorem check_sound d rows v w : check d rows v w = true -> (quadratic d rows w <= quadratic d rows v)%R.
Proof.
  unfold check. rewrite andb_true_iff, not_positive_real. intros [F H].
  rewrite (compared d) in H by assumption. lra.
Qed.

Theorem check_complete d rows v w : fits d rows v w = true -> check d rows v w = false ->
  (quadratic d rows w > quadratic d rows v)%R.
Proof.
  intros F H. unfold check in H. rewrite F in H. simpl in H.
  apply Rnot_le_lt. intro L.
  assert (T : not_positive (plus (form rows w) (opposite (form rows v))) = true).
  { apply not_positive_real. rewrite (compared d) by assumption. lra. }
  congruence.
Qed.

Print Assumptions check_sound. (* if the exact checker accepts, wᵀMw ≤ vᵀMv over the real numbers *)
Print Assumptions check_complete. (* if it rejects lists of the right lengths, wᵀMw > vᵀMv *)

(* Lists, pairs and booleans become OCaml's; integers stay the ones proved about. *)
Extraction "judge.ml" check.
